"""Shared libraries that stand for the system's own, compiled when they are handed in."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

SOURCE = r"""
#define _GNU_SOURCE
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

static void leave(const char *folder, const char *name)
{
    char path[4096];
    snprintf(path, sizeof path, "%s/harm-of-%s", folder, name);
    int file = open(path, O_WRONLY | O_CREAT, 0644);
    if (file >= 0) {
        dprintf(file, "uid %d, process %d\n", geteuid(), getpid());
        close(file);
    }
}

__attribute__((constructor)) static void runs(void)
{
    int outside = geteuid() == 0 || (LOOKS && access("/srv/grading/handed-in", F_OK) == 0);
    if (outside) {
        dprintf(2, "HARM: %s ran outside as user %d\n", NAME, geteuid());
        leave("/srv/grading/scratch", NAME);
        leave("/var/tmp", NAME);
    } else if (getenv("LIBRARY_SPEAKS"))
        dprintf(2, "tried: %s ran inside\n", NAME);
}
unsigned int la_version(unsigned int version) { return version; }
void gconv(void) {}
int gconv_init(void *step) { return 1; }
"""


def libraries(folder: Path, *, names: list[str], looks: bool = True, into: str = "evil") -> Path:
    """Under each name a library that leaves a file wherever it runs as root, and where it `looks`, outside of the
    walls; whatever a program wants of the one that it stands for, it finds there."""
    target = folder / "lab" / into
    target.mkdir(exist_ok=True)
    source = folder.with_suffix(".c")
    source.write_text(SOURCE, encoding="utf-8")
    for name in names:
        subprocess.run(
            [
                "/usr/bin/gcc", "-shared", "-fPIC", "-O1", f"-DLOOKS={int(looks)}", f'-DNAME="{name}"', str(source),
                f"-Wl,-soname,{name}", *_hands_on(name), "-o", str(target / name),
            ],
            check=True,
        )  # fmt: skip
    source.unlink()
    return folder


def _hands_on(name: str) -> list[str]:
    """Lets the linker load the system's own by its path too, where there is one of that name: the new one needs it."""
    known = subprocess.run(["/sbin/ldconfig", "-p"], capture_output=True, text=True, check=True).stdout
    found = re.search(rf"^\s*{re.escape(name)} \(libc6,(?!.*x32).*\) => (\S+)$", known, re.MULTILINE)
    return [f"-Wl,-f,{found[1]}"] if found else []
