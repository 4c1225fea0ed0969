"""Runs commands of the diagnosis with nothing in reach but the batch: ``python -I -S guard.py JSON``.

Not imported by the proof: it is the whole of what the concealed process starts from, and imports only the standard
library. The JSON names the folders that may be read and written, those that are put on the import path, the file
descriptor on which tampering is told, and the commands' arguments.

Python's audit hooks see every file that is opened, every folder that is listed, every import, every process that is
started and every connection, and cannot be taken out again. What compiled code reads past Python they do not see, and
code that first rewrote the functions that this file calls would blind them: this keeps out whatever looks for answers,
and not what sets out to break it.
"""

import json
import os
import sys
from importlib import import_module

HIDDEN = ("virtualrig", "proof")
STARTS = ("subprocess.Popen", "os.system", "os.exec", "os.fork", "os.forkpty", "os.posix_spawn", "os.spawn")
CHANGES = ("os.remove", "os.rename", "os.rmdir", "os.mkdir", "os.link", "os.symlink", "os.truncate", "shutil.rmtree")
# The others have one path; what a symbolic link points to is refused when it is opened.
PATHS = {"os.rename": 2, "os.link": 2}
CONNECTS = ("socket.connect", "socket.bind", "socket.sendto", "socket.getaddrinfo", "os.kill")
WRITES = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND


def guard(readable: list[str], writable: list[str], tell: int) -> None:
    """Refuse, and tell of, whatever leaves the folders given."""
    readable, writable = map(tuple, (map(os.path.realpath, [*readable, *writable]), map(os.path.realpath, writable)))

    def inside(path, folders) -> bool:
        if isinstance(path, int):
            return True
        place = os.path.realpath(os.fsdecode(path))
        return any(place == folder or place.startswith(folder + os.sep) for folder in folders)

    def refuse(what: str) -> None:
        os.write(tell, f"{what}\n".encode())
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
        elif event == "import" and arguments[0].partition(".")[0] in HIDDEN:
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


def main(told: dict) -> None:
    """Set up the import path, close the door and run the commands; exits with the highest of their codes."""
    sys.path[:] = told["standard"] + told["path"]
    # The first time it is imported it looks all over the machine for fonts, and starts a program to ask for more.
    import_module("matplotlib.font_manager")
    guard(told["readable"], told["writable"], told["tell"])
    run, codes = import_module("ccmodel.cli").main, [0]
    for words in told["commands"]:
        sys.argv = ["ccmodel", *words]
        try:
            run()
        except SystemExit as ended:
            codes.append(_code(ended))
    sys.exit(max(codes))


def _code(ended: SystemExit) -> int:
    """The exit code of what ended a command; as Python does, a text is said and counts as one."""
    if isinstance(ended.code, str):
        print(ended.code, file=sys.stderr)
        return 1
    return ended.code or 0


if __name__ == "__main__":
    main(json.loads(sys.argv[1]))
