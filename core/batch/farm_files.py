"""A batch as a job of the engines that studios have: Open Job Description (a template in JSON), and
a job type of Flamenco (JavaScript). Each object is one task: a command that anyone can run."""

from __future__ import annotations

import json
import shlex
from collections.abc import Sequence
from pathlib import Path

from ..files import write_text_atomic
from .cluster import Limits, Work

OPENJD, FLAMENCO = "patina.openjd.json", "patina_batch.js"  # names of the files


def write_openjd(out: Path, work: Sequence[Work], limits: Limits) -> Path:
    """Write the template of a job with one task for each object
    (specification 2023-09). Returns its path."""
    run: dict[str, object] = {"command": "{{Task.File.Run}}"}
    if limits.seconds:
        run["timeout"] = max(1, int(limits.seconds))
    script = {
        "actions": {"onRun": run},
        "embeddedFiles": [
            {
                "name": "Run", "type": "TEXT", "runnable": True, "filename": "run.sh",
                "data": "#!/bin/sh\ncase '{{Task.Param.Object}}' in\n"
                + "".join(
                    f"{shlex.quote(one.item.name)}) exec {_shell(one)} ;;\n" for one in work
                )
                + "esac\nexit 2\n",
            }
        ],
    }  # fmt: skip
    amount = {"name": "amount.worker.memory", "min": int(limits.gigabytes * 1024)}  # MiB
    memory = {"hostRequirements": {"amounts": [amount]}} if limits.gigabytes else {}
    template = {
        "specificationVersion": "jobtemplate-2023-09",
        "name": "Patina",
        "steps": [
            {
                "name": "Objects",
                "parameterSpace": {
                    "taskParameterDefinitions": [
                        {
                            "name": "Object", "type": "STRING",
                            "range": [one.item.name for one in work],
                        }
                    ]
                },
                **memory,
                "script": script,
            }
        ],
    }  # fmt: skip
    path = out / OPENJD
    write_text_atomic(path, json.dumps(template, indent=1) + "\n")
    return path


def write_flamenco(out: Path, work: Sequence[Work]) -> Path:
    """Write a job type with one task for each object; copy it to Flamenco's folder ``scripts``.
    Returns its path."""
    objects = [
        {"name": one.item.name, "exe": one.words[0], "args": list(one.words[1:])} for one in work
    ]
    script = f"""// Written by `patina batch --to flamenco`. Copy this file to the folder
// "scripts" of the Flamenco Manager, and submit a job of the type "Patina Batch".
const JOB_TYPE = {{
    label: "Patina Batch",
    settings: [],
}};

const OBJECTS = {json.dumps(objects, indent=1)};

function compileJob(job) {{
    for (const one of OBJECTS) {{
        const task = author.Task(one.name, "misc");
        task.addCommand(author.Command("exec", {{ exe: one.exe, args: one.args }}));
        job.addTask(task);
    }}
}}
"""
    path = out / FLAMENCO
    write_text_atomic(path, script)
    return path


def _shell(one: Work) -> str:
    return shlex.join(one.words)
