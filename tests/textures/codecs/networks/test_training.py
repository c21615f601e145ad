"""Training of the networks: it learns, stops, goes on, and shares work."""

from __future__ import annotations

import csv
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("torch", reason="needs the extra 'btf'")

from nacre.errors import NacreError
from nacre.textures.codecs.codec import CODECS, TrainingRun
from nacre.textures.codecs.codec_file import load_codec
from nacre.textures.codecs.networks import (
    CustomSettings,
    NetworkRecipe,
    TrainingRecipe,
    UnifiedSettings,
    training,
)
from nacre.textures.codecs.networks.journal import COLUMNS, Journal
from tests.textures.codecs.networks.made import OTHER, texture
from tests.textures.support import ByImage

SIZES = {
    "latent": 6, "angular": (32, 32), "features": 20, "hidden": (32,), "decoder_hidden": (32, 32)
}  # fmt: skip
SMALL = UnifiedSettings(**SIZES)
RECIPE = TrainingRecipe(
    texels=24, batch=24, encoder_directions=100, loss_directions=60, optimizer="adam"
)
FILES = [texture(seed) for seed in range(4)]
ROOT = Path(__file__).parents[4]


def train(settings=SMALL, recipe=RECIPE, files=FILES, **others):
    kind = CODECS["unified" if isinstance(settings, UnifiedSettings) else "custom"]
    lengths = {
        k: others.pop(k) for k in ("steps", "minutes", "device", "save_every") if k in others
    }
    run = TrainingRun(list(range(len(files))), files.__getitem__, **others)
    return kind.train(run, NetworkRecipe(settings, recipe, **lengths))


def same(one, other) -> bool:
    pairs = zip(one.arrays().items(), other.arrays().items(), strict=True)
    return all(a[0] == b[0] and np.array_equal(a[1], b[1]) for a, b in pairs)


def error(network, made) -> float:
    """Mean difference of logarithms of a texture from what its codes decode to."""
    texels = made.texels(slice(None))
    codes = network.encoder(made.wi, made.wo)(texels)
    decoded = network.decoder(made.wi, made.wo)(codes)
    return float(np.abs(np.log(decoded + 0.01) - np.log(texels + 0.01)).mean())


def table(path: Path) -> list[dict[str, str]]:
    """Rows of a journal."""
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def spread(made) -> float:
    """The same of the mean of all training textures, which a network must beat."""
    mean = np.mean([np.log(f.values + 0.01).mean() for f in FILES])
    return float(np.abs(np.log(made.values + 0.01) - mean).mean())


@pytest.mark.parametrize(
    ("optimizer", "precision", "decoder"),
    [
        ("adam", "single", "network"),
        ("muon", "single", "network"),
        ("adam", "bfloat16", "network"),
        ("adam", "single", "bilinear"),
    ],
)
def test_a_network_learns_textures_and_encodes_one_it_never_saw(optimizer, precision, decoder):
    settings = UnifiedSettings(**SIZES, decoder=decoder)
    recipe = TrainingRecipe(
        texels=24, batch=24, encoder_directions=100, loss_directions=60, learning_rate=1e-2,
        optimizer=optimizer, precision=precision,
    )  # fmt: skip
    network = train(settings, recipe, steps=300)
    for made in (FILES[0], texture(9), texture(9, directions=OTHER)):
        assert error(network, made) < 0.4 * spread(made)
    assert network.metadata["held out"] < 0.45
    assert network.metadata["materials"] == [f"made {seed}" for seed in range(4)]
    assert network.metadata["steps"] == 300


def test_the_reference_recipe_takes_steps_of_plain_gradient_descent():
    recipe = TrainingRecipe.named("reference", held_out=0.0, texels=10, permute=False)
    first, second = train(recipe=recipe, steps=1), train(recipe=recipe, steps=2)
    assert recipe.rate(0.0) == recipe.rate(0.7) == 0.2
    untrained = train(recipe=TrainingRecipe.named("reference", learning_rate=1e-30), steps=1)
    moved = {k: first.arrays()[k] - v for k, v in untrained.arrays().items()}
    assert 0 < max(np.abs(v).max() for v in moved.values()) < 0.2
    assert not same(first, second)


def test_a_custom_network_is_overfitted_to_one_material():
    recipe = TrainingRecipe(
        texels=24, batch=12, loss_directions=60, learning_rate=1e-2, loss="l2", permute=False
    )
    settings = CustomSettings(latent=4, channels=(8, 8), hidden=(32,), decoder_hidden=(64, 64, 64))
    network = train(settings, recipe, FILES[:1], steps=200)
    assert error(network, FILES[0]) < 0.35 * spread(FILES[0])
    mixed = [FILES[0], texture(1, directions=OTHER)]
    with pytest.raises(NacreError, match="2 sets of directions, the network of 2019 takes one"):
        train(settings, recipe, mixed, steps=1)


def test_a_unified_network_trains_on_several_sets_of_directions():
    mixed = [FILES[0], texture(1, directions=OTHER)]
    network = train(files=mixed, steps=150)
    for made in mixed:
        assert error(network, made) < 0.6 * spread(made)


@pytest.mark.parametrize("optimizer", ["adam", "muon"])
def test_training_that_was_stopped_goes_on_as_if_it_never_was(tmp_path, optimizer):
    recipe = TrainingRecipe(
        texels=20, batch=16, encoder_directions=100, loss_directions=60, validate_every=7,
        patience=50, optimizer=optimizer,
    )  # fmt: skip
    whole = train(recipe=recipe, steps=34, journal=tmp_path / "whole.csv")
    state = tmp_path / "state"

    def stop_at(step):
        def stop(stage, done, total, note):
            if done == step:
                raise KeyboardInterrupt

        return stop

    for step in (13, 20):
        with pytest.raises(KeyboardInterrupt):
            train(recipe=recipe, steps=34, state=state, journal=tmp_path / "parts.csv",
                  progress=stop_at(step))  # fmt: skip
        assert state.exists()
    seen = []
    resumed = train(
        recipe=recipe,
        steps=34,
        state=state,
        journal=tmp_path / "parts.csv",
        progress=lambda *step: seen.append(step[1]),
    )
    assert seen == list(range(21, 35))
    assert same(resumed, whole)
    assert resumed.metadata == whole.metadata
    rows, parts = (
        [[r["step"], r["learning_rate"], r["loss"], r["validation"]] for r in table(path)]
        for path in (tmp_path / "whole.csv", tmp_path / "parts.csv")
    )
    assert rows == parts
    assert [row[0] for row in rows] == ["10", "20", "30", "34"]
    assert sorted(p.name for p in tmp_path.iterdir()) == ["parts.csv", "state", "whole.csv"]


@pytest.mark.parametrize("where", ["_validate", "result"])
def test_an_interrupt_after_the_last_step_loses_nothing(tmp_path, monkeypatch, where):
    state = tmp_path / "state"
    whole = train(steps=4, state=tmp_path / "whole")

    def interrupted(*_):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(training._Training, where, interrupted)
        with pytest.raises(KeyboardInterrupt):
            train(steps=4, state=state)
    steps: list[int] = []
    resumed = train(steps=4, state=state, progress=lambda *step: steps.append(step[1]))
    assert not steps
    assert same(resumed, whole)
    assert resumed.metadata == whole.metadata


def test_a_state_of_another_training_or_a_damaged_one_is_refused(tmp_path):
    state = tmp_path / "state"

    def stop(*_):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        train(steps=4, state=state, fingerprint="these files", progress=stop)
    given = {"steps": 4, "state": state, "fingerprint": "these files"}
    for other in ({"recipe": TrainingRecipe(seed=1)}, {"fingerprint": "others"}, {"steps": 5}):
        with pytest.raises(NacreError, match="belongs to another run"):
            train(**given | other)
    with pytest.raises(NacreError, match="belongs to another run"):
        train(minutes=1.0, state=state, fingerprint="these files")
    for content in (state.read_bytes()[:-100], b""):
        state.write_bytes(content)
        with pytest.raises(NacreError, match="cannot be read, remove it"):
            train(steps=4, state=state)


@pytest.mark.parametrize(
    "row", ["\u00b2,1,1,1,", '3,"' + "x" * 200_000 + '",1,1,', "9" * 5000 + ",1,1,1,"]
)
def test_a_journal_with_damage_is_refused_or_goes_on(tmp_path, row):
    path = tmp_path / "x.csv"
    path.write_text(f"{','.join(COLUMNS)}\n1,1,1,1,\n{row}\n", encoding="utf-8")
    if "x" in row:
        with pytest.raises(NacreError, match=r"x\.csv: is damaged"):
            Journal(path, 5)
    else:
        with Journal(path, 5) as journal:
            assert journal.last == 1


def test_images_are_read_once(tmp_path):
    made = [texture(seed) for seed in range(2)]
    plain = [m.replaced(values=m.values.astype(np.float16).astype(np.float32)) for m in made]
    images = [ByImage(made) for made in plain]
    assert same(train(files=images, steps=30), train(files=plain, steps=30))
    for made in images:
        assert sorted(made.read) == list(range(made.pair_count))


def test_patience_stops_training_and_gives_the_best_weights():
    recipe = TrainingRecipe(
        texels=24, batch=24, encoder_directions=100, loss_directions=60, validate_every=5,
        patience=2, decay=False, learning_rate=0.03, held_out=0.2,
    )  # fmt: skip
    seen: list[tuple[int, str]] = []
    network = train(
        recipe=recipe, steps=2000, progress=lambda s, done, t, note: seen.append((done, note))
    )
    looks = {done: float(note.split("held out ")[1]) for done, note in seen if "held out" in note}
    looks = {done: loss for done, loss in looks.items() if done % 5 == 0}
    best = min(looks, key=looks.__getitem__)
    assert max(looks) < 2000
    assert network.metadata["steps"] == best
    assert network.metadata["held out"] == pytest.approx(looks[best], abs=1e-4)


def test_minutes_end_training_and_bring_the_rate_to_zero(tmp_path):
    start = time.monotonic()
    train(minutes=2.0 / 60.0, journal=tmp_path / "x.csv")
    assert 1.5 < time.monotonic() - start < 30.0
    rates = [float(row["learning_rate"]) for row in table(tmp_path / "x.csv")]
    assert max(rates) > 0.8e-2
    assert rates[-1] < 3e-3


def test_training_that_diverges_says_so():
    recipe = TrainingRecipe(texels=24, batch=24, optimizer="sgd", learning_rate=1e12, warm_up=0.0)
    with pytest.raises(NacreError, match="diverged at step 10"):
        train(recipe=recipe, steps=20)


def test_a_device_that_is_not_there_is_an_error_of_one_line():
    with pytest.raises(NacreError, match="device 'cuda:77' cannot be used"):
        train(device="cuda:77", steps=1)


def test_events_for_tensorboard_hold_the_losses(tmp_path):
    event_pb2 = pytest.importorskip("tensorboardX.proto.event_pb2", reason="needs the extra 'btf'")
    train(steps=20, events=tmp_path / "events", journal=tmp_path / "x.csv")
    (file,) = (tmp_path / "events").iterdir()
    found, data = {}, file.read_bytes()
    while data:  # records: length, its checksum, an event, its checksum
        end = 12 + int.from_bytes(data[:8], "little")
        for value in event_pb2.Event.FromString(data[12:end]).summary.value:
            found[value.tag, event_pb2.Event.FromString(data[12:end]).step] = value.simple_value
        data = data[end + 4 :]
    rows = {int(row["step"]): float(row["loss"]) for row in table(tmp_path / "x.csv")}
    for step in (10, 20):
        assert found["loss/training", step] == pytest.approx(rows[step], rel=1e-5)


SCRIPT = """
import json, os, sys
from pathlib import Path
from nacre.textures.codecs.codec_file import save_codec
from tests.textures.codecs.networks.test_training import train
settings = json.loads(sys.argv[2])
folder = Path(sys.argv[1])
if "state" in settings:
    settings["state"] = Path(settings["state"])
network = train(**settings)
rank, size = os.environ.get("RANK", 0), os.environ.get("WORLD_SIZE", 1)
save_codec(network, folder / f"{rank} of {size}.safetensors")
"""


def start(folder: Path, *launcher: str, **settings) -> subprocess.Popen[bytes]:
    (folder / "script.py").write_text(SCRIPT)
    search = os.pathsep.join([str(ROOT / "src"), str(ROOT), os.environ.get("PYTHONPATH", "")])
    return subprocess.Popen(
        [sys.executable, *launcher, folder / "script.py", folder, json.dumps(settings)],
        env={**os.environ, "PYTHONPATH": search, "OMP_NUM_THREADS": "1"},
    )


@pytest.mark.slow
def test_two_processes_train_one_network_and_it_is_that_of_one_process(tmp_path):
    launcher = "-m", "torch.distributed.run", "--standalone", "--nproc-per-node=2"
    assert start(tmp_path, *launcher, steps=5).wait(120) == 0
    first, second = (load_codec(tmp_path / f"{rank} of 2.safetensors") for rank in (0, 1))
    assert same(first, second)
    alone = train(steps=5).arrays()
    for name, array in first.arrays().items():
        np.testing.assert_allclose(array, alone[name], atol=2e-6)
    assert first.metadata["held out"] == pytest.approx(train(steps=5).metadata["held out"], 1e-4)


@pytest.mark.slow
def test_a_process_that_is_killed_loses_what_came_after_its_last_checkpoint(tmp_path):
    state = tmp_path / "state"
    settings = {"steps": 100_000, "state": str(state), "save_every": 0.2}
    killed = start(tmp_path, **settings)
    deadline = time.monotonic() + 60.0
    while not state.exists() and time.monotonic() < deadline:
        time.sleep(0.05)
    os.kill(killed.pid, signal.SIGKILL)
    killed.wait()
    seen: list[int] = []

    def stop(stage, done, total, note):
        seen.append(done)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        train(steps=100_000, state=state, progress=stop)
    assert seen[0] > 1


@pytest.mark.slow
def test_an_interrupt_waits_for_the_step_and_saves(tmp_path):
    state = tmp_path / "state"
    stopped = start(tmp_path, steps=100_000, state=str(state), save_every=0.2)
    deadline = time.monotonic() + 60.0
    while not state.exists() and time.monotonic() < deadline:
        time.sleep(0.05)
    before = state.stat().st_mtime_ns
    stopped.send_signal(signal.SIGINT)
    try:
        assert stopped.wait(30) != 0
    finally:
        stopped.kill()
    assert state.stat().st_mtime_ns > before
    assert not (tmp_path / "0 of 1.safetensors").exists()
