"""Help: every option says what it is for, what kind of value it takes, and its default; -h as well as --help."""

from __future__ import annotations

import re
import subprocess
import sys

import pytest
from typer.core import TyperArgument

from command_options import COMMANDS, options_of
from rodatlas.cli import main
from rodatlas.cli.app import ENDINGS
from rodatlas.cli.command import CONTEXT, KINDS

OPTIONS = [(name, p) for name in COMMANDS for p in options_of(name)]


def page(capsys, *arguments: str) -> str:
    with pytest.raises(SystemExit) as stop:
        main(list(arguments))
    assert stop.value.code == 0
    return capsys.readouterr().out


@pytest.mark.parametrize("name", COMMANDS)
def test_every_page_is_the_same_by_either_name_and_names_no_types_of_python(capsys, name):
    text = page(capsys, name, "-h")
    assert text == page(capsys, name, "--help")
    assert not re.search(r"\bTEXT\b|<\w+>|\{FILE", text)
    assert "-h, --help" in text
    width = max(map(len, text.splitlines()))
    assert width <= 120


@pytest.mark.parametrize(("name", "option"), OPTIONS, ids=lambda x: x if isinstance(x, str) else x.opts[0])
def test_every_option_has_a_help_a_kind_and_a_default(capsys, name, option):
    assert option.help
    left, right = option.get_help_record(COMMANDS[name].context_class(COMMANDS[name], **CONTEXT))
    assert " ".join(f"{left} {right}".split()) in " ".join(page(capsys, name, "--help").split())
    assert left == (option.opts[0] if option.is_flag else f"{option.opts[0]} {option.metavar}")
    if option.is_flag:
        return
    assert option.metavar in KINDS
    end = re.search(r"\[(default: [^]]+|required)\]$", right)
    assert end is not None, "shows no default"
    if option.required:
        assert end[1] == "required"
    elif option.default is not None:
        assert end[1] == f"default: {option.default}"


def test_every_argument_has_a_help(capsys):
    for name, c in COMMANDS.items():
        for argument in (p for p in c.params if isinstance(p, TyperArgument)):
            assert argument.help in " ".join(page(capsys, name, "-h").split())


def test_the_first_page_lists_commands_in_full_and_exit_codes(capsys):
    text = page(capsys, "-h")
    assert text == page(capsys, "--help") == page(capsys)
    for name, c in COMMANDS.items():
        assert re.search(rf"^  {name} ", text, re.MULTILINE)
        assert c.help in " ".join(text.split())
    for line in ENDINGS.splitlines()[1:]:
        assert line in text


def test_help_does_not_wait_for_the_solver():
    """No library that takes long to load, on any page of help; models need NumPy to say what their controls are."""
    code = (
        "import sys\nfrom rodatlas.cli import main\n"
        f"for name in {list(COMMANDS)}:\n"
        "    try:\n        main([name, '-h'])\n    except SystemExit as leave:\n        assert not leave.code\n"
        "heavy = {'numba', 'casadi', 'matplotlib', 'scipy', 'h5py', 'pandas'} & set(sys.modules)\n"
        "assert not heavy, heavy\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, timeout=120)
    code = "import sys, rodatlas.cli.app\nassert 'numpy' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, timeout=120)
