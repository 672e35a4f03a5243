"""Decompression by zstd, which Python includes only since 3.14: otherwise by the package zstandard, or by the system's
libzstd, the library that legopt itself uses."""

from __future__ import annotations

import ctypes
import ctypes.util
import functools
from collections.abc import Callable

from .errors import MissingPackageError


def decompress(packed: bytes, most: int) -> bytes:
    """Returns the content of one frame, at most `most` bytes. ValueError if it is damaged or larger.
    MissingPackageError if this machine has no decompressor."""
    return _decompressor()(packed, most)


@functools.cache
def _decompressor() -> Callable[[bytes, int], bytes]:
    for make in (_of_python, _of_package, _of_system):
        found = make()
        if found:
            return found
    raise MissingPackageError("traces are compressed by zstd, and neither its library nor a Python package for it is "
                              "here; on Debian: apt install libzstd1, elsewhere: pip install zstandard")


def _of_python() -> Callable[[bytes, int], bytes] | None:
    try:
        from compression import zstd
    except ImportError:
        return None

    def run(packed: bytes, most: int) -> bytes:
        decompressor = zstd.ZstdDecompressor()
        try:
            plain = decompressor.decompress(packed, max_length=most + 1)
        except zstd.ZstdError as error:
            raise ValueError(str(error)) from error
        if not decompressor.eof or decompressor.unused_data:
            raise ValueError("not one whole frame of the size allowed")
        return plain

    return run


def _of_package() -> Callable[[bytes, int], bytes] | None:
    try:
        import zstandard
    except ImportError:
        return None

    def run(packed: bytes, most: int) -> bytes:
        try:
            if not 0 <= zstandard.frame_content_size(packed) <= most:
                raise ValueError("of unknown size, or larger than allowed")
            return zstandard.ZstdDecompressor().decompress(packed)
        except zstandard.ZstdError as error:
            raise ValueError(str(error)) from error

    return run


def _load(name: str | None) -> ctypes.CDLL | None:
    try:
        return ctypes.CDLL(name) if name else None
    except OSError:
        return None


def _of_system() -> Callable[[bytes, int], bytes] | None:
    library = _load("libzstd.so.1") or _load(ctypes.util.find_library("zstd"))  # the second one starts programs
    if library is None:
        return None
    library.ZSTD_getFrameContentSize.restype = ctypes.c_ulonglong
    library.ZSTD_getFrameContentSize.argtypes = [ctypes.c_char_p, ctypes.c_size_t]
    library.ZSTD_decompress.restype = ctypes.c_size_t
    library.ZSTD_decompress.argtypes = [ctypes.c_char_p, ctypes.c_size_t, ctypes.c_char_p, ctypes.c_size_t]
    library.ZSTD_isError.restype = ctypes.c_uint
    library.ZSTD_isError.argtypes = [ctypes.c_size_t]

    def run(packed: bytes, most: int) -> bytes:
        size = library.ZSTD_getFrameContentSize(packed, len(packed))
        if size > most:  # "unknown" and "error" are larger than any size
            raise ValueError("of unknown size, or larger than allowed")
        plain = ctypes.create_string_buffer(max(size, 1))
        got = library.ZSTD_decompress(plain, size, packed, len(packed))
        if library.ZSTD_isError(got) or got != size:
            raise ValueError("damaged")
        return plain.raw[:size]

    return run
