"""The dialect for other tools: its XML, and a dissector for Wireshark made from it by pymavlink's generator."""

from __future__ import annotations

import contextlib
import io
import shutil
import tempfile
from pathlib import Path
from typing import Final

from ..errors import LinkError

NAME: Final = "mav_robot_status"
INCLUDED: Final = ("common", "standard", "minimal")


def xml_path() -> Path:
    """Where our XML is: in the installed package, or beside it in a checkout."""
    package = Path(__file__).resolve().parents[1]
    installed = package / "data" / f"{NAME}.xml"
    return installed if installed.exists() else package.parent / "dialects" / f"{NAME}.xml"


def write_files(folder: str) -> list[Path]:
    """Write the XML with what it includes, and the Lua dissector, into `folder`. Raises LinkError if it cannot."""
    from pymavlink import dialects
    from pymavlink.generator import mavgen

    public = Path(dialects.__file__ or "").parent / "v20"
    target = Path(folder)
    try:
        target.mkdir(parents=True, exist_ok=True)
        written = [Path(shutil.copyfile(xml_path(), target / f"{NAME}.xml"))]
        with tempfile.TemporaryDirectory() as work, contextlib.redirect_stdout(io.StringIO()):
            for name in INCLUDED:
                shutil.copyfile(public / f"{name}.xml", Path(work) / f"{name}.xml")
            source = Path(shutil.copyfile(xml_path(), Path(work) / f"{NAME}.xml"))
            options = mavgen.Opts(str(Path(work) / f"{NAME}.lua"), wire_protocol="2.0", language="WLua", validate=False)
            with contextlib.redirect_stderr(io.StringIO()):
                mavgen.mavgen(options, [str(source)])
            written.append(Path(shutil.copyfile(Path(work) / f"{NAME}.lua", target / f"{NAME}.lua")))
    except OSError as error:
        raise LinkError(f"cannot write to {folder}: {error.strerror}") from None
    return written
