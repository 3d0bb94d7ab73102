from __future__ import annotations

import json
import re
from importlib.resources import files

from mav_robot_status.interface import STATES
from mav_robot_status.language import LINK, LOOKS, ROBOT_STATES, TONES, style_sheet
from mav_robot_status.language.shapes import SHAPES
from mav_robot_status.publishers.web.looks import fields_module

ASSETS = files("mav_robot_status.publishers.web") / "assets"


def constants() -> dict[str, object]:
    found = re.findall(r"^export const (\w+) = (.*);$", fields_module().decode(), re.M)
    return {name: json.loads(value) for name, value in found}


def test_the_browser_gets_every_look_of_every_field() -> None:
    module = constants()
    rows = [*module["STATES"], module["LINK"]]  # type: ignore[misc]
    assert {row["name"] for row in rows} == {*(field.name for field in STATES), LINK}
    for row in rows:
        given = [(value, look["word"], look["shape"], look["tone"], look["bar"]) for value, look in row["looks"]]
        assert given == [(v, look.word, look.shape, look.tone, look.bar) for v, look in LOOKS[row["name"]].items()]


def test_every_shape_has_a_drawing() -> None:
    shapes = {look.shape for looks in LOOKS.values() for look in looks.values()}
    assert shapes | {state.shape for state in ROBOT_STATES} == set(SHAPES)
    assert "{{shapes}}" in (ASSETS / "index.html").read_text("utf-8")


def test_the_browser_gets_every_state_of_a_robot() -> None:
    states = constants()["ROBOT_STATES"]
    assert [one["word"] for one in states] == [state.word for state in ROBOT_STATES]  # type: ignore[attr-defined]


def test_the_sheet_has_both_colours_of_every_tone() -> None:
    light, dark = style_sheet().split("@media screen and (prefers-color-scheme: dark)")
    for name, tone in TONES.items():
        assert f"--{name}: {tone.light};" in light
        assert f"--{name}: {tone.dark};" in dark


def test_the_page_has_no_colours_or_words_of_its_own() -> None:
    tones = {colour.lower() for tone in TONES.values() for colour in (tone.light, tone.dark)}
    words = {look.word for looks in LOOKS.values() for look in looks.values() if look.word.isupper()}
    words |= {state.word for state in ROBOT_STATES}
    for file in ASSETS.iterdir():
        text = file.read_text("utf-8")
        assert not tones & set(re.findall(r"#[0-9a-f]{6}", text.lower())), file.name
        if file.name.endswith(".js"):
            quoted = set(re.findall(r"\"([A-Z][A-Z ]+)\"", text))
            assert quoted & words <= {"LOST", "UNKNOWN"}, file.name  # a state of a link, a mode
