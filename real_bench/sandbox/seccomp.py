"""A filter of system calls: no new processes, no network, no hold on other processes (Linux).

Standard library only: it is run before anything else, see ``start.py``. The filter is a program
for the kernel's small packet-filter machine; each instruction is (code, if true, if false, k).
"""

import ctypes
import errno
import os
import platform
import struct

_LOAD, _EQUAL, _AT_LEAST, _ANY_BIT, _RETURN = 0x20, 0x15, 0x35, 0x45, 0x06
_NUMBER, _ARCHITECTURE, _FIRST_ARGUMENT = 0, 4, 16  # places in struct seccomp_data
_ALLOW, _KILL, _REFUSE = 0x7FFF0000, 0x80000000, 0x00050000
_X32 = 0x40000000  # another way into the same kernel, with numbers of its own
_CLONE_THREAD = 0x00010000
_SET_NO_NEW_PRIVS, _GET_SECCOMP, _SET_SECCOMP, _FILTER = 38, 21, 22, 2

# The same on all machines: these calls are newer than both tables.
_NEWER = {
    "clone3": 435,
    "pidfd_open": 434,
    "pidfd_send_signal": 424,
    "pidfd_getfd": 438,
    "io_uring_setup": 425,
    "memfd_secret": 447,
    "open_tree": 428,
    "fsopen": 430,
    "process_madvise": 440,
    "mount_setattr": 442,
    "process_mrelease": 448,
}
_X86_64 = {
    "fork": 57, "vfork": 58, "clone": 56, "socket": 41, "kill": 62, "tkill": 200, "tgkill": 234,
    "rt_sigqueueinfo": 129, "rt_tgsigqueueinfo": 297, "ptrace": 101, "process_vm_readv": 310,
    "process_vm_writev": 311, "memfd_create": 319, "shmget": 29, "msgget": 68, "semget": 64,
    "bpf": 321, "userfaultfd": 323, "perf_event_open": 298, "keyctl": 250, "add_key": 248,
    "request_key": 249, "unshare": 272, "setns": 308, "mount": 165, "umount2": 166,
    "pivot_root": 155, "chroot": 161, "prlimit64": 302, "setpriority": 141, "kcmp": 312,
}  # fmt: skip
_AARCH64 = {
    "clone": 220, "socket": 198, "kill": 129, "tkill": 130, "tgkill": 131,
    "rt_sigqueueinfo": 138, "rt_tgsigqueueinfo": 240, "ptrace": 117, "process_vm_readv": 270,
    "process_vm_writev": 271, "memfd_create": 279, "shmget": 194, "msgget": 186, "semget": 190,
    "bpf": 280, "userfaultfd": 282, "perf_event_open": 241, "keyctl": 219, "add_key": 217,
    "request_key": 218, "unshare": 97, "setns": 268, "mount": 40, "umount2": 39,
    "pivot_root": 41, "chroot": 51, "prlimit64": 261, "setpriority": 140, "kcmp": 272,
}  # fmt: skip
_MACHINES = {"x86_64": (0xC000003E, _X86_64), "aarch64": (0xC00000B7, _AARCH64)}

_OWN_PID_ONLY = ("kill", "tgkill", "prlimit64")  # allowed where the first argument is its own


def available() -> bool:
    """Whether this system can filter system calls, and their numbers are known."""
    if platform.system() != "Linux" or platform.machine() not in _MACHINES:
        return False
    return int(ctypes.CDLL(None).prctl(_GET_SECCOMP, 0, 0, 0, 0)) >= 0


def restrict() -> None:
    """Filter the system calls of this thread and of everything it starts; raises OSError."""
    program = _filter_program(os.getpid())
    code = ctypes.create_string_buffer(b"".join(struct.pack("<HBBI", *line) for line in program))
    size_and_place = struct.pack("@HP", len(program), ctypes.addressof(code))
    libc = ctypes.CDLL(None, use_errno=True)
    none = ctypes.c_ulong(0)
    if (
        libc.prctl(_SET_NO_NEW_PRIVS, ctypes.c_ulong(1), none, none, none) != 0
        or libc.prctl(_SET_SECCOMP, ctypes.c_ulong(_FILTER), size_and_place, none, none) != 0
    ):
        raise OSError(ctypes.get_errno(), "the system call filter was refused")


def _filter_program(own_pid: int) -> list[tuple[int, int, int, int]]:
    architecture, numbers = _MACHINES[platform.machine()]
    refuse = (_RETURN, 0, 0, _REFUSE | errno.EPERM)
    program = [
        (_LOAD, 0, 0, _ARCHITECTURE),
        (_EQUAL, 1, 0, architecture),
        (_RETURN, 0, 0, _KILL),
        (_LOAD, 0, 0, _NUMBER),
    ]
    if platform.machine() == "x86_64":
        program += [(_AT_LEAST, 0, 1, _X32), refuse]
    for name, number in {**numbers, **_NEWER}.items():
        allow = (_RETURN, 0, 0, _ALLOW)
        if (
            name == "clone3"
        ):  # its flags are in memory, which a filter cannot see: libc then uses clone
            rest = [(_RETURN, 0, 0, _REFUSE | errno.ENOSYS)]
        elif name == "clone":
            rest = [(_LOAD, 0, 0, _FIRST_ARGUMENT), (_ANY_BIT, 0, 1, _CLONE_THREAD), allow, refuse]
        elif name in _OWN_PID_ONLY:
            rest = [(_LOAD, 0, 0, _FIRST_ARGUMENT)]
            for pid in (0, own_pid) if name == "prlimit64" else (own_pid,):
                rest += [(_EQUAL, 0, 1, pid), allow]
            rest += [refuse]
        else:
            rest = [refuse]
        program += [(_EQUAL, 0, len(rest), number), *rest]
    return [*program, (_RETURN, 0, 0, _ALLOW)]
