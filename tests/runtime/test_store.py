"""States of work, from which another process goes on."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from nacre.errors import FormatError, NacreError
from nacre.runtime.store import Store, restore_optimizer


def test_a_state_comes_back_as_it_was(tmp_path: Path):
    store = Store(tmp_path / "x.state", "made")
    state = {
        "codes": np.arange(6, dtype=np.float16).reshape(2, 3),
        "empty": np.zeros((0, 3)),
        "scalar": np.array(3.5),
        "loss": math.inf,
        "steps": (1, [2.5, None, True], "text"),
        "by number": {0: np.ones(2, np.uint8), 1: "one"},
    }
    store.save(state)
    found = Store(tmp_path / "x.state", "made").load()
    assert found["loss"] == math.inf
    assert found["steps"] == state["steps"]
    assert found["by number"][1] == "one"
    for name in ("codes", "empty", "scalar"):
        assert found[name].dtype == state[name].dtype
        np.testing.assert_array_equal(found[name], state[name])


def test_optimizers_of_pytorch_come_back_as_they_were(tmp_path: Path):
    torch = pytest.importorskip("torch", reason="needs the extra 'latent'")
    weights = torch.arange(4.0, requires_grad=True)
    adam = torch.optim.Adam([weights])
    weights.square().sum().backward()
    adam.step()
    generator = torch.Generator().manual_seed(3)
    half = torch.arange(3.0, dtype=torch.bfloat16)
    store = Store(tmp_path / "x.state")
    store.save({"adam": adam.state_dict(), "generator": generator.get_state(), "half": half})
    found = store.load()
    again = torch.optim.Adam([weights], lr=0.5)
    restore_optimizer(again, found["adam"])
    for name, value in adam.state_dict()["state"][0].items():
        assert torch.equal(again.state_dict()["state"][0][name], value)
    assert again.param_groups[0]["lr"] == 0.5
    found["adam"]["param_groups"][0]["capturable"] = True  # which no processor can do
    restore_optimizer(again, found["adam"])
    again.step()
    with pytest.raises(ValueError, match="of other parameters"):
        restore_optimizer(torch.optim.Adam([torch.zeros(5, requires_grad=True)]), found["adam"])
    generator.set_state(found["generator"])
    assert torch.equal(found["half"], half)


def test_states_of_other_work_and_damaged_ones_are_refused(tmp_path: Path):
    path = tmp_path / "x.state"
    Store(path, "one").save([1])
    with pytest.raises(NacreError, match="belongs to another run; remove it"):
        Store(path, "two").load()
    path.write_bytes(path.read_bytes()[:-3])
    with pytest.raises(NacreError, match="cannot be read, remove it to start over"):
        Store(path, "one").load()
    assert Store(tmp_path / "none").load() is None


def test_names_are_files_beside(tmp_path: Path):
    store = Store(tmp_path / "x.state")
    for name in ("", "functions", "codes"):
        store.save(name, name)
    (tmp_path / "x.stately").write_text("another's")
    assert [p.name for p in store.files()] == [
        "x.state",
        "x.state.codes.state",
        "x.state.functions.state",
    ]
    store.remove("code*")
    assert ("codes" in store, "functions" in store) == (False, True)
    store.remove()
    assert [p.name for p in tmp_path.iterdir()] == ["x.stately"]


def test_steps_go_on_where_they_were_interrupted(tmp_path: Path):
    def run(stop: int | None) -> list[int]:
        taken: list[int] = []
        total = {"sum": np.zeros(())}
        store = Store(tmp_path / "x.state")
        steps = store.steps(5, lambda: total, lambda kept: total.update(kept))
        try:
            for step in steps:
                taken.append(step)
                total["sum"] = total["sum"] + step
                if step == stop:
                    steps.throw(KeyboardInterrupt)
        except KeyboardInterrupt:
            return taken
        assert total["sum"] == 10
        return taken

    assert run(stop=2) == [0, 1, 2]
    assert run(stop=None) == [3, 4]
    assert run(stop=None) == []


@pytest.mark.parametrize("step", [-1, 4, math.inf, "x", None, []])
def test_a_step_that_is_none_of_the_work_is_refused(tmp_path: Path, step: object):
    store = Store(tmp_path / "x.state")
    store.save({"step": step, "state": {}})
    with pytest.raises(NacreError, match=r"x\.state: cannot be read, remove it to start over"):
        next(store.steps(3, dict, lambda _: None))


def test_what_a_library_makes_of_damage_names_the_file(tmp_path: Path):
    store = Store(tmp_path / "x.state")
    store.save({"step": 1, "state": 0.5})
    with pytest.raises(NacreError, match=r"x\.state: .*no attribute 'copy'"):
        next(store.steps(3, dict, lambda state: state.copy()))


def test_nothing_is_kept_without_a_path():
    store = Store(None)
    store.save({"a": 1})
    assert (store.load(), store.files(), "" in store) == (None, [], False)
    assert list(store.steps(3, dict, lambda state: None)) == [0, 1, 2]


def test_a_state_that_finds_no_room_is_an_error_with_its_name(tmp_path: Path):
    resource = pytest.importorskip("resource", reason="files have no largest size here")
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (10_000, limits[1]))
    try:
        with pytest.raises(FormatError, match=r"full\.state: cannot be written: File too large"):
            Store(tmp_path / "full.state").save({"values": np.zeros(100_000)})
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert not list(tmp_path.iterdir())
