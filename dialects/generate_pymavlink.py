"""Writes a pymavlink dialect of the messages that we use: `python dialects/generate_pymavlink.py OUTPUT_FILE`.

The tests compare with it. pymavlink's generator makes it from the XML that `generate.py` reads. It is not committed:
`tests/pymavlink_dialect.py` runs this when a test needs it.
"""

from __future__ import annotations

import pathlib
import sys
import tempfile
import xml.etree.ElementTree as ET

from generate import USED, sources
from pymavlink.generator import mavgen


def trimmed_xml() -> str:
    """One XML file with only the messages in USED, without references to enumerations."""
    root = ET.Element("mavlink")
    ET.SubElement(root, "version").text = "3"
    out = ET.SubElement(root, "messages")
    found = {}
    for path in sources():
        for message in ET.parse(path).getroot().iter("message"):
            if message.get("name") in USED:
                found[message.get("name")] = message
    for name in USED:
        for field in found[name].iter("field"):
            field.attrib.pop("enum", None)
            field.attrib.pop("display", None)
        out.append(found[name])
    return ET.tostring(root, encoding="unicode")


def main() -> int:
    with tempfile.TemporaryDirectory() as folder:
        source = pathlib.Path(folder) / "used.xml"
        source.write_text(trimmed_xml())
        options = mavgen.Opts(sys.argv[1], wire_protocol="2.0", language="Python3", validate=False)
        mavgen.mavgen(options, [str(source)])
    return 0


if __name__ == "__main__":
    sys.exit(main())
