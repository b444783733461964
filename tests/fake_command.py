"""A program in place of `patina fit`, for tests of batches: quick, and it can be told to fail.

fake_command.py fit CAPTURE --out DIR: a capture with the word `crash` ends with a signal, one with
`wrong` in exit code 2, one with `slow` takes a minute, one with `pause` half a second, one with
`large` half a GB, and one with `flaky` fails at the first attempt. The others write a result.json
of their content, and a line to the file runs.txt of the capture's folder.
"""

from __future__ import annotations

import hashlib
import json
import os
import signal
import sys
import time
from pathlib import Path


def main() -> int:
    capture, out = Path(sys.argv[2]), Path(sys.argv[sys.argv.index("--out") + 1])
    text, runs = capture.read_text(), capture.with_name("runs.txt")
    with runs.open("a") as file:
        file.write("started\n")
    if "wrong" in text:
        print("patina: the capture is wrong", file=sys.stderr)
        return 2
    if "crash" in text or ("flaky" in text and runs.read_text().count("started") < 2):
        os.kill(os.getpid(), signal.SIGABRT)
    kept = bytearray(500 << 20) if "large" in text else b""
    time.sleep(60 if "slow" in text or kept else 0.5 if "pause" in text else 0.1)
    out.mkdir(parents=True, exist_ok=True)
    materials = [{"name": "clay", "held_out": {"typical": 0.05}}]
    content = json.dumps({"materials": materials, "warnings": [], "text": text}).encode()
    (out / "result.json").write_bytes(content)
    record = {"result.json": {"owner": "fit", "content": hashlib.blake2b(content).hexdigest()[:32]}}
    (out / ".patina-files").write_text(json.dumps(record))
    with runs.open("a") as file:
        file.write("finished\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
