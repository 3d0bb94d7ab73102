"""The dialect for other tools: its XML, and a Wireshark dissector that pymavlink's generator makes from it."""

from __future__ import annotations

import contextlib
import io
import shutil
import tempfile
from pathlib import Path
from typing import Final

from ..data_files import data_file
from ..errors import LinkError

NAME: Final = "mav_robot_status"
INCLUDED: Final = ("common", "standard", "minimal")

ANY_PORT: Final = """
-- any other UDP port: a datagram that contains only whole MAVLink frames

local function only_frames(buffer)
    local offset = 0
    while offset + 8 <= buffer:len() do
        local magic, length = buffer(offset, 1):uint(), buffer(offset + 1, 1):uint()
        if magic == 0xfd then
            offset = offset + 12 + length + 13 * (buffer(offset + 2, 1):uint() % 2) -- the last term: a signature
        elseif magic == 0xfe then
            offset = offset + 8 + length
        else
            return false
        end
    end
    return offset > 0 and offset == buffer:len()
end

mavlink_proto:register_heuristic("udp", function(buffer, pinfo, tree)
    if not only_frames(buffer) then return false end
    mavlink_proto.dissector(buffer, pinfo, tree)
    return true
end)
"""
"""Lua: the generated dissector registers three UDP ports; a vehicle or an `--out` may use any port."""


def write_files(folder: str) -> list[Path]:
    """Write our XML and the Lua dissector into `folder`. Raises LinkError if that fails."""
    from pymavlink import dialects
    from pymavlink.generator import mavgen

    public = Path(dialects.__file__ or "").parent / "v20"
    xml = data_file(f"{NAME}.xml", "dialects")
    target = Path(folder)
    try:
        target.mkdir(parents=True, exist_ok=True)
        written = [Path(shutil.copyfile(xml, target / f"{NAME}.xml"))]
        with tempfile.TemporaryDirectory() as work, contextlib.redirect_stdout(io.StringIO()):
            for name in INCLUDED:
                shutil.copyfile(public / f"{name}.xml", Path(work) / f"{name}.xml")
            source = Path(shutil.copyfile(xml, Path(work) / f"{NAME}.xml"))
            options = mavgen.Opts(str(Path(work) / f"{NAME}.lua"), wire_protocol="2.0", language="WLua", validate=False)
            with contextlib.redirect_stderr(io.StringIO()):
                mavgen.mavgen(options, [str(source)])
            lua = target / f"{NAME}.lua"
            lua.write_text((Path(work) / f"{NAME}.lua").read_text("utf-8") + ANY_PORT, "utf-8")
            written.append(lua)
    except OSError as error:
        raise LinkError(f"cannot write to {folder}: {error.strerror}") from None
    return written
