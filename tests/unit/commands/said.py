"""Parses a command line with the arguments of its command."""

from __future__ import annotations

import argparse

from mav_robot_status.commands import command


def said(name: str, *arguments: str) -> argparse.Namespace:
    parser = argparse.ArgumentParser()
    parser.set_defaults(command=name)
    command(name).arguments(parser)
    return parser.parse_args(arguments)
