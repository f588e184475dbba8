"""scripts/assets.py tells of every binary file that is not as scripts/assets.sha256 lists it."""

from __future__ import annotations

from scripts.assets import assets, differences


def test_what_is_listed_is_what_is_there() -> None:
    there = assets()
    assert "src/elocute/head/assets/head.npz" in there and "README.md" not in there
    assert differences(there, there) == []


def test_a_change_an_addition_and_a_loss_are_told() -> None:
    listed = {"a.npz": "1" * 64, "b.npz": "2" * 64, "c.npz": "3" * 64}
    there = {"a.npz": "1" * 64, "b.npz": "9" * 64, "d.npz": "4" * 64}
    assert differences(listed, there) == [
        "d.npz: not in scripts/assets.sha256",
        "c.npz: listed, but not there",
        "b.npz: not as listed",
    ]
