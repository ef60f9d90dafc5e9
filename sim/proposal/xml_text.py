"""Elements added to a URDF's text, which otherwise stays as its author wrote it."""

from __future__ import annotations

from collections.abc import Sequence
from xml.parsers import expat
from xml.sax.saxutils import quoteattr


def fixed_joint(name: str, parent: str, child: str, xyz: str, rpy: str = "0 0 0") -> list[str]:
    """Return a fixed joint, with the child's position [m] and rotation [rad] in the parent."""
    return [
        f'  <joint name={quoteattr(name)} type="fixed">',
        f"    <parent link={quoteattr(parent)}/>",
        f"    <child link={quoteattr(child)}/>",
        f'    <origin xyz="{xyz}" rpy="{rpy}"/>',
        "  </joint>",
    ]


def with_elements(urdf: str, lines: Sequence[str]) -> str:
    """Add elements at the end of a URDF, so that all other lines keep their numbers."""
    # Offsets count UTF-8 bytes, whatever encoding the text declares.
    content, end = urdf.encode(), 0
    parser = expat.ParserCreate("utf-8")

    def closed(_tag: str) -> None:
        nonlocal end
        end = parser.CurrentByteIndex

    parser.EndElementHandler = closed
    parser.Parse(content, True)
    added = "".join(f"{line}\n" for line in ("", *lines))
    return (content[:end] + added.encode() + content[end:]).decode()
