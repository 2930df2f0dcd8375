"""Restrict which files this process can reach, without any privilege (Linux 5.13 and newer).

Standard library only: it is run before anything else, see ``start.py``.
"""

import ctypes
import os
import platform
import struct
from pathlib import Path

_CREATE_RULESET, _ADD_RULE, _RESTRICT_SELF = 444, 445, 446  # the same on all machines
_PATH_BENEATH, _VERSION = 1, 1
_SET_NO_NEW_PRIVS = 38

_EXECUTE, _WRITE, _READ, _LIST = 1, 2, 4, 8
_TRUNCATE, _IOCTL = 1 << 14, 1 << 15
_ON_FILES = _EXECUTE | _WRITE | _READ | _TRUNCATE | _IOCTL
_RIGHTS_BY_VERSION = {1: 13, 2: 14, 3: 15, 4: 15, 5: 16}  # so many bits are known
_READ_ONLY = _EXECUTE | _READ | _LIST


def version() -> int:
    """The kernel's version of Landlock; 0 for none."""
    if platform.system() != "Linux":
        return 0
    found = ctypes.CDLL(None).syscall(
        ctypes.c_long(_CREATE_RULESET), None, ctypes.c_size_t(0), ctypes.c_uint32(_VERSION)
    )
    return max(int(found), 0)


def restrict(read: list[str], write: list[str], names: list[str]) -> None:
    """Restrict this process to these files and folders and their contents; raises OSError.

    Of folders in ``names`` only the names of their contents can be seen.
    """
    known = (1 << _RIGHTS_BY_VERSION.get(version(), 16)) - 1
    libc = ctypes.CDLL(None, use_errno=True)
    attributes = struct.pack("<Q", known)
    ruleset = _checked(
        libc.syscall(
            ctypes.c_long(_CREATE_RULESET),
            attributes,
            ctypes.c_size_t(len(attributes)),
            ctypes.c_uint32(0),
        )
    )
    for paths, rights in ((read, _READ_ONLY), (write, known & ~_EXECUTE), (names, _LIST)):
        for path in paths:
            _allow(libc, ruleset, path, rights & known)
    none = ctypes.c_ulong(0)
    _checked(libc.prctl(_SET_NO_NEW_PRIVS, ctypes.c_ulong(1), none, none, none))
    _checked(libc.syscall(ctypes.c_long(_RESTRICT_SELF), ruleset, ctypes.c_uint32(0)))
    os.close(ruleset)


def _allow(libc: ctypes.CDLL, ruleset: int, path: str, rights: int) -> None:
    place = os.open(path, os.O_PATH | os.O_CLOEXEC)
    try:
        rule = struct.pack("<Qi", rights if Path(path).is_dir() else rights & _ON_FILES, place)
        _checked(
            libc.syscall(
                ctypes.c_long(_ADD_RULE),
                ruleset,
                ctypes.c_int(_PATH_BENEATH),
                rule,
                ctypes.c_uint32(0),
            )
        )
    finally:
        os.close(place)


def _checked(result: int) -> int:
    if result < 0:
        raise OSError(ctypes.get_errno(), "the kernel refused to restrict the file system")
    return result
