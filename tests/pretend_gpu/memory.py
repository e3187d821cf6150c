"""Device memory that the host cannot touch, full of NaN until something is written."""

import ctypes
import mmap

CAPACITY = 8 << 30  # bytes of addresses; memory is taken where it is touched
PAGE = mmap.PAGESIZE
ALIGNMENT = 256  # bytes, as CUDA's
WORD = 16  # bytes that the detector keeps for four of memory: all 0 where there is no array
NOBODY_YET = 0x01  # as every byte of them
NOT_A_NUMBER = 0xFF  # as every byte

NOTHING, EVERYTHING = 0, mmap.PROT_READ | mmap.PROT_WRITE
RESERVED = mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS | 0x4000  # MAP_NORESERVE, which Python has no name for
FORGET = 4  # MADV_DONTNEED

_libc = ctypes.CDLL(None, use_errno=True)
_libc.mmap.restype = ctypes.c_void_p
_libc.mmap.argtypes = [ctypes.c_void_p, ctypes.c_size_t, *[ctypes.c_int] * 3, ctypes.c_long]
_libc.mprotect.argtypes = _libc.madvise.argtypes = [ctypes.c_void_p, ctypes.c_size_t, ctypes.c_int]


def _checked(result: int, function: object, arguments: tuple) -> int:
    if result in (-1, ctypes.c_void_p(-1).value):
        raise OSError(ctypes.get_errno(), f"pretend GPU: the system refuses memory: {arguments}")
    return result


_libc.mmap.errcheck = _libc.mprotect.errcheck = _libc.madvise.errcheck = _checked


class DeviceMemory:
    """Allocations end where a page ends, and behind each is a page that nobody may touch.

    As a context manager it is open, for what a GPU does; in between, a host that reads it gets a segmentation fault.
    """

    def __init__(self) -> None:
        self.begin = _reserved(CAPACITY, NOTHING)
        self.words = _reserved(CAPACITY // 4 * WORD, EVERYTHING)
        self.sizes: dict[int, int] = {}  # of the allocations, by address
        self._free = [(self.begin, CAPACITY)]
        self._open = 0

    @property
    def used(self) -> int:
        """Bytes in use."""
        return sum(self.sizes.values())

    def allocate(self, size: int) -> int | None:
        """The address of new memory, or None where there is no room."""
        room = _pages(size) + PAGE
        for n, (at, free) in enumerate(self._free):
            if free >= room:
                self._free[n] = (at + room, free - room)
                break
        else:
            return None
        address = at + _pages(size) - -(-max(size, 1) // ALIGNMENT) * ALIGNMENT
        self.sizes[address] = size
        _libc.mprotect(at, room - PAGE, EVERYTHING)
        ctypes.memset(address, NOT_A_NUMBER, size)
        ctypes.memset(self._words_of(address), NOBODY_YET, -(-size // 4) * WORD)
        if not self._open:
            _libc.mprotect(at, room - PAGE, NOTHING)
        return address

    def release(self, address: int) -> None:
        """Give memory back; it is used again only when there is no other, so that late readers are caught."""
        at, room = address // PAGE * PAGE, _pages(self.sizes.pop(address)) + PAGE
        _libc.madvise(at, room, FORGET)
        _libc.madvise(self._words_of(at), room // 4 * WORD, FORGET)
        _libc.mprotect(at, room, NOTHING)
        self._free.append((at, room))

    def whose(self, address: int) -> str:
        """Which allocation an address is in, for messages."""
        for begin, size in self.sizes.items():
            if begin <= address < begin + size:
                return f"byte {address - begin} of an array of {size}"
        return "no array"

    def __enter__(self) -> None:
        self._open += 1
        if self._open == 1:
            self._protect(EVERYTHING)

    def __exit__(self, *exception: object) -> None:
        self._open -= 1
        if self._open == 0:
            self._protect(NOTHING)

    def _words_of(self, address: int) -> int:
        return self.words + (address - self.begin) // 4 * WORD

    def _protect(self, how: int) -> None:
        for address, size in self.sizes.items():
            _libc.mprotect(address // PAGE * PAGE, _pages(size), how)


def _reserved(size: int, protection: int) -> int:
    return _libc.mmap(None, size, protection, RESERVED, -1, 0)


def _pages(size: int) -> int:
    """Bytes of the pages for an allocation."""
    return -(-max(size, 1) // PAGE) * PAGE
