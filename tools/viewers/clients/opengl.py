"""An OpenGL context without a display: EGL on Mesa's surfaceless platform, which draws on the CPU if need be."""

import ctypes
import sys
from typing import NoReturn

MISSING = 3  # exit code, as in environment.py

PLATFORM_SURFACELESS_MESA = 0x31DD  # EGL_MESA_platform_surfaceless
OPENGL_API = 0x30A2
NONE = 0x3038
SURFACE_TYPE, PBUFFER_BIT = 0x3033, 0x0001
RENDERABLE_TYPE, OPENGL_BIT = 0x3040, 0x0008
DEPTH_SIZE = 0x3025
WIDTH, HEIGHT = 0x3057, 0x3056
MAJOR_VERSION, MINOR_VERSION = 0x3098, 0x30FB
PROFILE_MASK, COMPATIBILITY_BIT = 0x30FD, 0x0002
VERSION, RENDERER = 0x1F02, 0x1F01


def make_current() -> None:
    """Make a context of OpenGL 4.5, which Storm needs, current on this thread; ends the process if there is none.

    It has a small surface of its own, because Storm copies its picture to what stands for the window.
    """
    try:
        egl = ctypes.CDLL("libEGL.so.1")
    except OSError:
        _missing("no libEGL.so.1; on Debian: apt-get install libegl1 libgl1 libgl1-mesa-dri")
    pointer = ctypes.c_void_p
    for name in ("eglGetPlatformDisplay", "eglCreatePbufferSurface", "eglCreateContext"):
        getattr(egl, name).restype = pointer
    display = pointer(egl.eglGetPlatformDisplay(PLATFORM_SURFACELESS_MESA, None, None))
    if not egl.eglInitialize(display, None, None):
        _missing("EGL has no surfaceless platform here; on Debian: apt-get install libegl-mesa0 libgl1-mesa-dri")
    egl.eglBindAPI(OPENGL_API)
    config, found = pointer(), ctypes.c_int()
    wanted = _list(SURFACE_TYPE, PBUFFER_BIT, RENDERABLE_TYPE, OPENGL_BIT, DEPTH_SIZE, 24)
    egl.eglChooseConfig(display, wanted, ctypes.byref(config), 1, ctypes.byref(found))
    surface = pointer(egl.eglCreatePbufferSurface(display, config, _list(WIDTH, 64, HEIGHT, 64)))
    version = _list(MAJOR_VERSION, 4, MINOR_VERSION, 5, PROFILE_MASK, COMPATIBILITY_BIT)
    context = pointer(egl.eglCreateContext(display, config, None, version))
    if not egl.eglMakeCurrent(display, surface, surface, context):
        _missing("EGL gives no context of OpenGL 4.5; on Debian: apt-get install libgl1-mesa-dri")


def name() -> str:
    """Version and renderer of the current context, as OpenGL tells them."""
    library = ctypes.CDLL("libGL.so.1")
    library.glGetString.restype = ctypes.c_char_p
    return ", ".join(library.glGetString(key).decode() for key in (VERSION, RENDERER))


def _list(*values: int) -> ctypes.Array:
    """Attributes as EGL takes them: a list that ends with NONE."""
    return (ctypes.c_int * (len(values) + 1))(*values, NONE)


def _missing(text: str) -> NoReturn:
    print(text, file=sys.stderr)
    sys.exit(MISSING)
