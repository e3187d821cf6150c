"""Which USD files a directory holds; needs no USD code."""

from pathlib import Path

USD_SUFFIXES = (".usdc", ".usda", ".usdz", ".usd")  # in the order in which they are looked for


def usd_files(directory: Path) -> list[Path]:
    """The whole USD files of a directory, a merged one first; not what a killed run left half written."""
    files = [file for suffix in USD_SUFFIXES for file in sorted(directory.glob(f"*{suffix}"))]
    return [file for file in files if not file.stem.endswith(".part")]
