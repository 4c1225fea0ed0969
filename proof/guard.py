"""Runs commands of the diagnosis with access to the batch alone: ``python -I -S guard.py JSON``.

The concealed process starts from this file, which imports only the standard library; nothing else imports it. The JSON
argument names the folders that may be read and written, the import path, the file descriptor for reports of tampering
and the arguments of the commands.

Python's audit hooks see every opened file, listed folder, import, started process and connection, and cannot be
removed. They do not see what compiled code reads without Python. Code that replaces the functions called here could
also disable them. The guard stops a diagnosis that looks for the answer, not one written to defeat the guard.
"""

import json
import os
import sys
from importlib import import_module

FORBIDDEN_IMPORTS = ("virtualrig", "proof")
STARTS = ("subprocess.Popen", "os.system", "os.exec", "os.fork", "os.forkpty", "os.posix_spawn", "os.spawn")
CHANGES = ("os.remove", "os.rename", "os.rmdir", "os.mkdir", "os.link", "os.symlink", "os.truncate", "shutil.rmtree")
# Events with two paths. The target of a symbolic link is checked when it is opened.
PATHS = {"os.rename": 2, "os.link": 2}
CONNECTS = ("socket.connect", "socket.bind", "socket.sendto", "socket.getaddrinfo", "os.kill")
WRITES = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND


def guard(readable: list[str], writable: list[str], report_fd: int) -> None:
    """Refuse every access outside the given folders, and report each on a file descriptor."""
    readable, writable = map(tuple, (map(os.path.realpath, [*readable, *writable]), map(os.path.realpath, writable)))

    def inside(path, folders) -> bool:
        if isinstance(path, int):
            return True
        place = os.path.realpath(os.fsdecode(path))
        return any(place == folder or place.startswith(folder + os.sep) for folder in folders)

    def refuse(what: str) -> None:
        os.write(report_fd, f"{what}\n".encode())
        raise PermissionError(what)

    def hook(event: str, arguments: tuple) -> None:
        if event == "open":
            path, mode, flags = arguments
            writes = bool(flags & WRITES) if isinstance(flags, int) else any(c in (mode or "r") for c in "wax+")
            if path is not None and not inside(path, writable if writes else readable):
                refuse(f"{'wrote to' if writes else 'read'} {os.fsdecode(path)}")
        elif event in ("os.listdir", "os.scandir", "os.chdir"):
            if not inside(arguments[0] if arguments[0] is not None else os.getcwd(), readable):
                refuse(f"looked into {arguments[0]}")
        elif event == "import" and arguments[0].partition(".")[0] in FORBIDDEN_IMPORTS:
            refuse(f"imported {arguments[0]}")
        elif event in CHANGES:
            for path in arguments[: PATHS.get(event, 1)]:
                if not inside(path, writable):
                    refuse(f"{event} of {path}")
        elif event in STARTS:
            refuse(f"started a process: {event}")
        elif event in CONNECTS:
            refuse(f"looked outside: {event}")

    sys.addaudithook(hook)


def main(settings: dict) -> None:
    """Set the import path, install the guard and run the commands; the exit code is the highest of theirs."""
    sys.path[:] = settings["standard"] + settings["path"]
    # Its first import searches the machine for fonts and starts a program, which the guard would refuse.
    import_module("matplotlib.font_manager")
    guard(settings["readable"], settings["writable"], settings["report_fd"])
    run, codes = import_module("ccmodel.cli").main, [0]
    for arguments in settings["commands"]:
        sys.argv = ["ccmodel", *arguments]
        try:
            run()
        except SystemExit as exit_:
            codes.append(_exit_code(exit_))
    sys.exit(max(codes))


def _exit_code(exit_: SystemExit) -> int:
    """Exit code of a SystemExit. As in Python, a text is printed and counts as 1."""
    if isinstance(exit_.code, str):
        print(exit_.code, file=sys.stderr)
        return 1
    return exit_.code or 0


if __name__ == "__main__":
    main(json.loads(sys.argv[1]))
