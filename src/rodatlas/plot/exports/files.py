"""Writing a file at once: a reader sees the old one or the new one, never a part."""

from __future__ import annotations

import os
import uuid
from pathlib import Path


def replace_file(path: str | os.PathLike[str], content: bytes) -> Path:
    """Write bytes under another name in the same folder, and rename.

    Raises
    ------
    OSError
        when that is not possible; an older file is untouched then.
    """
    target = Path(path)
    partial = target.with_name(f".{target.name}.{uuid.uuid4().hex[:12]}.partial")
    try:
        partial.write_bytes(content)
        os.replace(partial, target)
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(target)) from None
    finally:
        partial.unlink(missing_ok=True)
    return target
