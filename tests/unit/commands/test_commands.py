from __future__ import annotations

import argparse
from pathlib import Path

import pytest

from mav_robot_status import commands
from mav_robot_status.commands import COMMANDS, command

SHARED = {"__init__", "arms", "options", "overrides"}


def test_every_row_has_a_module_and_every_module_has_a_row() -> None:
    modules = {path.stem for path in Path(commands.__file__).parent.glob("*.py")}
    assert modules - SHARED == {name.replace("-", "_") for name in COMMANDS}


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_has_arguments_and_runs(name: str) -> None:
    parser = argparse.ArgumentParser()
    command(name).arguments(parser)
    assert parser.format_usage()
    assert callable(command(name).run)
