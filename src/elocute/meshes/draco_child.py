"""Decodes Draco in a subprocess, because a malicious stream can crash the decoder.

Standard input: a line of JSON, the streams' lengths; then the streams. Standard output: a line of
JSON, name, type and shape of each array; then their bytes. "f0" is the first stream's faces, "a0_3"
its attribute of unique id 3. DracoPy is the only code that meets the streams.
"""

from __future__ import annotations

import json
import sys
from typing import Any

MEMORY_MAX_BYTES = 1_500_000_000


def main() -> None:
    """Unpack standard input to standard output."""
    import DracoPy
    import numpy as np

    lengths = json.loads(sys.stdin.buffer.readline())
    streams = [sys.stdin.buffer.read(length) for length in lengths]
    if sys.platform != "win32":
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (MEMORY_MAX_BYTES, MEMORY_MAX_BYTES))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    unpacked: dict[str, Any] = {}
    for index, stream in enumerate(streams):
        mesh = DracoPy.decode(stream)
        unpacked[f"f{index}"] = np.ascontiguousarray(mesh.faces)
        for attribute in mesh.attributes:
            name = f"a{index}_{attribute['unique_id']}"
            unpacked[name] = np.ascontiguousarray(attribute["data"])
    header = [[name, array.dtype.str, array.shape] for name, array in unpacked.items()]
    sys.stdout.buffer.write(json.dumps(header).encode() + b"\n")
    for array in unpacked.values():
        sys.stdout.buffer.write(array.tobytes())


if __name__ == "__main__":
    main()
