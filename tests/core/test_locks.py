"""The lists that run.py installs from have checksums of every package, and follow the pins."""

from __future__ import annotations

import re

import pytest

from tools.check_extension import RELEASES
from tools.environment import BPY, LOCKS, TEST_TOOLS, lock_file
from tools.wheels import PLATFORMS, SUMS, requirements

LINE = re.compile(r"([a-zA-Z0-9._-]+)==(\S+)((?: --hash=sha256:[0-9a-f]{64})+)")
TARGETS = [(version, platform) for version in BPY for platform in PLATFORMS]


def packages(version, platform, tests) -> dict[str, tuple[str, set[str]]]:
    found = {}
    for line in lock_file(version, platform, tests).read_text("utf-8").splitlines()[1:]:
        name, number, sums = LINE.fullmatch(line).groups()
        found[name.lower()] = number, set(re.findall(r"[0-9a-f]{64}", sums))
    return found


@pytest.mark.parametrize(("version", "platform"), TARGETS)
def test_lists_follow_the_pins(version, platform):
    base, tests = (packages(version, platform, tests) for tests in (False, True))
    assert not set(base) & set(tests)
    for pins, found in (([f"bpy=={BPY[version]}", *requirements()], base), (TEST_TOOLS, tests)):
        for pin in pins:
            name, number = pin.split("==")
            assert found[name.lower()][0] == number, f"run python3 -m tools.lock: {pin}"
    assert platform != "windows-x64" or "colorama" in tests


@pytest.mark.parametrize(("version", "platform"), TARGETS)
def test_libraries_are_those_of_the_zips(version, platform):
    shipped = {line.split()[0] for line in SUMS.read_text("utf-8").splitlines()}
    base = packages(version, platform, False)
    for pin in requirements():
        assert base[pin.split("==")[0].lower()][1] & shipped, pin


def test_no_other_lists():
    expected = {lock_file(*target, tests) for target in TARGETS for tests in (False, True)}
    assert set(LOCKS.iterdir()) == expected | {release.lock for release in RELEASES}


@pytest.mark.parametrize("release", RELEASES, ids=lambda release: release.label)
def test_lists_of_the_other_versions_follow_theirs(release):
    lines = release.lock.read_text("utf-8").splitlines()[1:]
    found = [LINE.fullmatch(line).group(1, 2) for line in lines]
    assert found == [("bpy", release.bpy), ("numpy", release.numpy)]
