"""Files in a folder that several runs may share: replaced at once, held by one run at a time, never lost.

`atomic`: a reader sees the old file or the new one. `claim`: one process at a time makes a result. `aside`: what cannot
be used is renamed. `names`: exact, readable names, and digests. `code`: digests of the code itself.
"""

from rodatlas.files.aside import keep_other_json, set_aside
from rodatlas.files.atomic import remove_partials, replace_file, write_text
from rodatlas.files.claim import Held, alone_in, claimed, try_claim
from rodatlas.files.code import code_hash
from rodatlas.files.names import digest, exact

__all__ = [
    "Held", "alone_in", "claimed", "code_hash", "digest", "exact", "keep_other_json", "remove_partials", "replace_file",
    "set_aside", "try_claim", "write_text",
]  # fmt: skip
