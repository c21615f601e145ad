"""What is made of textures, against sums that are written out; and what is kept."""

from __future__ import annotations

import shutil
from dataclasses import replace

import numpy as np
import pytest

from lab.tests.reproduce.textures.conftest import SETTINGS
from nacre.btf import TableBtf
from nacre.errors import NacreError
from nacre.measured.textures import BONN
from nacre.measured.textures.domes import below, pairs
from nacre.textures.codecs import TexelCodec
from nacre.textures.selection import nearest_pair
from nacre_lab.reproduce.cache import SOURCES, Cache, module_digest
from nacre_lab.reproduce.textures import trial
from nacre_lab.reproduce.textures.materials import Material, collect, separate
from nacre_lab.reproduce.textures.methods import KINDS, find
from nacre_lab.reproduce.textures.sampling import (
    ALL,
    APART,
    AT_HELD_OUT,
    FRACTIONS,
    LOW_VIEWS,
    Sampling,
)
from nacre_lab.reproduce.textures.texture_figures import ANGLES
from tests.textures.codecs.networks.made import COARSE, texture
from tests.textures.made import write


class Means(TexelCodec):
    """Codes are the mean color of what is seen; decoded the same everywhere."""

    code_dim = 3

    def encoder(self, wi, wo):
        return lambda texels: texels.mean(axis=1)

    def decoder(self, wi, wo):
        return lambda codes: np.repeat(codes[:, None], len(wi), axis=1)


def test_errors_are_those_written_out():
    made, sampling = texture(3), Sampling("some", fraction=0.1, held_out=0.2)
    found = trial.errors(made, Means(), sampling, None, 5)
    seen, compared = sampling.pairs(*COARSE, 5)
    for row in (0, 17, 35):
        texel = made.values.reshape(36, -1, 3)[row].astype(np.float64)
        difference = texel[compared] - texel[seen].mean(0)
        assert found.squares[row] == pytest.approx(np.square(difference).mean(), rel=1e-4)
        logs = np.log(texel[compared] + 0.01) - np.log(texel[seen].mean(0) + 0.01)
        assert found.logarithms[row] == pytest.approx(np.abs(logs).mean(), rel=1e-4)
    assert found.mse == pytest.approx(found.squares.mean())
    some = trial.errors(made, Means(), sampling, 7, 5)
    assert len(some.squares) == 7
    assert np.isin(some.squares, found.squares).all()


def test_pictures_and_codes_are_of_the_right_texels():
    made = texture(4)
    picture = trial.picture(made, Means(), ALL, 11, 0)
    np.testing.assert_allclose(picture, made.values.mean(axis=2), rtol=1e-5)
    found = trial.codes(made, Means(), 5, 0)
    assert found.shape == (5, 3)
    every = made.values.mean(axis=2).reshape(-1, 3)
    assert all(np.isclose(every, code, rtol=1e-5).all(axis=1).any() for code in found)


def test_texels_are_shared_among_the_cores():
    class Watched(Means):
        def encoder(self, wi, wo):
            return self.watched(super().encoder(wi, wo))

        def decoder(self, wi, wo):
            return self.watched(super().decoder(wi, wo))

        def watched(self, run):
            return lambda values: sizes.append(len(values)) or run(values)

    made = texture(0, size=12)
    for make, maps in (
        (lambda codec: trial.errors(made, codec, ALL, None, 0), 2),
        (lambda codec: trial.picture(made, codec, ALL, 3, 0), 2),
        (lambda codec: trial.codes(made, codec, 144, 0), 1),
    ):
        sizes: list[int] = []
        make(Watched())
        assert sorted(sizes) == sorted([16, 64, 64] * maps)


def test_half_the_difference_of_two_measurements_is_their_noise():
    clean, random = texture(0, size=12), np.random.default_rng(1)
    pair = [
        TableBtf(clean.values + random.normal(0, 0.03, clean.values.shape), clean.wi, clean.wo)
        for _ in range(2)
    ]
    assert trial.noise(*pair) == pytest.approx(0.03**2, rel=0.02)
    with pytest.raises(ValueError, match="not of the same size"):
        trial.noise(clean, texture(0))


def test_samplings_choose_what_they_say():
    wi, wo = BONN.pairs()
    for sampling in FRACTIONS:
        seen, compared = sampling.pairs(wi, wo)
        assert len(seen) == round(sampling.fraction * len(wi))
        assert (np.diff(seen) > 0).all()
        assert len(compared) == len(wi)
    seen, _ = LOW_VIEWS.pairs(wi, wo)
    assert wo[seen, 2].min() == pytest.approx(np.cos(np.radians(45.0)), abs=1e-5)
    assert len(seen) == 151 * 61
    seen, compared = APART.pairs(wi, wo)
    np.testing.assert_array_equal(compared, AT_HELD_OUT.pairs(wi, wo)[1])
    assert len(seen) + len(compared) == len(wi)
    assert len(seen) == (151 - 15) ** 2
    out = {tuple(w) for w in BONN.directions} - {tuple(w) for w in wi[seen]}
    assert len(out) == 15
    assert not out & {tuple(w) for w in wo[seen]}
    other, _ = FRACTIONS[0].pairs(wi, wo, 1)
    assert set(other) != set(FRACTIONS[0].pairs(wi, wo, 0)[0])


@pytest.mark.parametrize(
    ("figure", "light", "view"), [("fig4", (60, 90), (45, 0)), ("fig8", (0, 0), (45, 0))]
)
def test_the_papers_angles_are_measured_in_bonn(figure, light, view):
    from nacre.measured.textures.directions import from_degrees

    wi, wo = BONN.pairs()
    made = TableBtf(np.zeros((1, 1, len(wi), 3), np.float32), wi, wo)
    assert ANGLES[figure] == (view, light)
    pair = nearest_pair(made, from_degrees(*light).astype("f4"), from_degrees(*view).astype("f4"))
    np.testing.assert_allclose(wi[pair], from_degrees(*light), atol=1e-6)
    np.testing.assert_allclose(wo[pair], from_degrees(*view), atol=1e-6)


def test_materials_are_collected_and_separated(folder, tmp_path):
    found = collect([folder / "bonn"])
    assert [m.name for m in found] == ["felt01", "felt02", "felt12", "wood_1", "wood_12", "wood_2"]
    assert {m.family for m in found} == {"felt", "wood"}
    training, unseen = separate(found)
    assert [m.name for m in unseen] == ["felt12", "wood_12"]
    assert len(training) == 4
    assert [m.name for m in separate(found, ["felt01"])[1]] == ["felt01"]
    assert collect([folder / "bonn" / "felt01.npz"]) == [found[0]]
    with pytest.raises(NacreError, match="oak: is not one of the textures"):
        separate(found, ["oak"])
    with pytest.raises(NacreError, match="name those to keep with --unseen"):
        separate(training)
    with pytest.raises(NacreError, match="all textures are unseen"):
        separate(unseen)
    (tmp_path / "empty").mkdir()
    with pytest.raises(NacreError, match="has no textures"):
        collect([tmp_path / "empty"])
    write(texture(0), tmp_path / "more" / "felt01.npz")
    with pytest.raises(NacreError, match="has the name of"):
        collect([folder / "bonn", tmp_path / "more"])


def test_other_values_have_another_fingerprint(tmp_path):
    found = []
    for seed, name in ((0, "a"), (0, "b"), (1, "a")):
        write(texture(seed), tmp_path / f"{name}.npz")
        found.append(Material(tmp_path / f"{name}.npz").fingerprint)
    assert found[0] == found[1] != found[2]


def test_methods_are_found_by_name(folder):
    method = find("custom-all-32")
    assert (method.kind, method.code_dim, method.own, method.name) == (
        *("custom-all", 32, False),
        "custom-all-32",
    )
    assert find("pca-own-8").own
    for name in ("custom", "custom-0", "other-8", "unified-2000", "unified-8x"):
        with pytest.raises(NacreError, match="is not a method"):
            find(name)


@pytest.mark.parametrize("name", ["unified-4", "custom-4", "custom-all-4", "pca-4", "pca-own-4"])
def test_codecs_and_results_are_kept(study, name):
    method, material = find(name), study.unseen[0]
    first = study.errors(method, material)
    assert first.squares.shape == (36,)
    files = {path: path.stat().st_mtime_ns for path in study.cache.folder.iterdir()}
    assert not [path for path in files if path.suffix == ".state"]
    study._codecs.clear()
    study.calls.clear()
    again = study.errors(method, material)
    np.testing.assert_array_equal(again.squares, first.squares)
    assert study.calls == []
    other = study.errors(method, material, texels=9)  # the codec is read from its file
    assert np.isin(other.squares.round(6), first.squares.round(6)).all()
    assert all(path.stat().st_mtime_ns == time for path, time in files.items())


@pytest.mark.parametrize("name", ["basis-4", "unified-4"])
def test_what_was_trained_is_not_lost_before_the_codec_is_saved(study, tmp_path, monkeypatch, name):
    calls: list[tuple[object, ...]] = []
    study = replace(
        study, cache=Cache(tmp_path), _codecs={}, progress=lambda *call: calls.append(call)
    )
    method, material = find(name), study.unseen[0]

    def interrupted(*_):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr("nacre_lab.reproduce.textures.study.save_codec", interrupted)
        with pytest.raises(KeyboardInterrupt):
            study.codec(method, material)
    assert calls
    calls.clear()
    study.codec(method, material)
    assert not calls
    assert {path.suffix for path in tmp_path.iterdir()} <= {".safetensors", ".csv"}  # the losses


def test_the_seed_is_that_of_the_settings(study):
    method, material = find("pca-own-4"), study.unseen[0]
    some = Sampling("some", fraction=0.1)
    found = []
    for seed in (0, 1):
        other = replace(study, settings=replace(SETTINGS, seed=seed), _codecs={})
        of_seed = trial.errors(material.load(), other.codec(method, material), some, 9, seed)
        np.testing.assert_array_equal(
            other.errors(method, material, some, 9).squares, of_seed.squares
        )
        picture = trial.picture(material.load(), other.codec(method, material), some, 3, seed)
        np.testing.assert_array_equal(other.picture(method, material, 3, some), picture)
        found.append((of_seed.squares, picture, other.deviation()))
    for first, second in zip(*found, strict=True):
        assert not np.array_equal(first, second)


@pytest.fixture
def sources(monkeypatch, tmp_path):
    """A copy of nacre's modules that keys are made of."""
    copy = tmp_path / "nacre"
    shutil.copytree(SOURCES[0], copy, ignore=shutil.ignore_patterns("*.safetensors", "*.pyc"))
    monkeypatch.setattr("nacre_lab.reproduce.cache.SOURCES", (copy, SOURCES[1]))
    return copy


@pytest.mark.parametrize(
    ("module", "names"),
    [
        ("numerics/channels.py", {"pca-4", "pca-own-4", "basis-4", "included-basis-4"}),
        ("measured/textures/domes.py", {"pca-4", "pca-own-4", "basis-4", "included-basis-4"}),
        (
            "textures/codecs/networks/unified.py",
            {"unified-4", "unified-max-4", "unified-l2-4", "custom-4", "custom-all-4"}
            | {"included-unified-4"},
        ),
        ("textures/codecs/symmetry.py", {"pca-4", "pca-own-4", "basis-4", "included-basis-4"}),
    ],
)
def test_codecs_are_made_again_when_a_module_that_decides_them_changes(
    study, sources, module, names
):
    def fingerprints():
        methods = (find(f"{kind}-4") for kind in KINDS)
        return {m.name: m.facts(study.training, study.settings)["code"] for m in methods}

    before = fingerprints()
    (sources / module).write_text("changed")
    after = fingerprints()
    assert {name for name, digest in after.items() if digest != before[name]} == names


def test_a_module_that_is_gone_does_not_count_in_silence():
    with pytest.raises(ValueError, match="no module is called textures/none"):
        module_digest("textures/none.py")


def test_results_are_made_again_when_the_domes_change(study, sources):
    method, material = find("pca-4"), study.unseen[0]
    study.errors(method, material, LOW_VIEWS)
    study.calls.clear()
    study.errors(method, material, LOW_VIEWS)
    assert study.calls == []
    (sources / "measured" / "textures" / "domes.py").write_text("changed")
    study.errors(method, material, LOW_VIEWS)
    assert study.calls


def test_fresh_makes_what_is_kept_again_once(study):
    method, material = find("pca-4"), study.unseen[0]
    study.errors(method, material)
    study.cache = Cache(study.cache.folder, fresh=True)  # as in the next run
    study._codecs.clear()
    study.calls.clear()
    study.errors(method, material)
    assert study.calls
    study.calls.clear()
    study.errors(method, material)
    assert study.calls == []


def test_damaged_files_are_made_again(study):
    method, material = find("pca-own-3"), study.unseen[1]
    first = study.errors(method, material)
    for path in study.cache.folder.iterdir():
        path.write_bytes(path.read_bytes()[:-10])
    study._codecs.clear()
    np.testing.assert_allclose(study.errors(method, material).squares, first.squares)


def test_a_codec_for_other_directions_is_left_out(study):
    silk = study.others[0]
    assert study.errors(find("pca-4"), silk) is None
    assert study.errors(find("pca-own-4"), silk) is not None
    assert study.errors(find("unified-4"), silk) is not None
    ((method, reason),) = study.skipped
    assert (method, study.skipped[method, reason]) == ("pca-4", ["silk12"])
    assert "pairs of directions only" in reason


def test_a_texture_without_the_pairs_that_are_to_be_seen_is_left_out(study, tmp_path):
    directions = BONN.directions
    steep = pairs(*[directions[~below(directions, 50.0)][::12]] * 2)
    write(texture(5, directions=steep), tmp_path / "steep12.npz")
    (material,) = collect([tmp_path / "steep12.npz"])
    study = replace(study, skipped={})
    method = find("pca-own-4")
    assert study.errors(method, material) is not None
    assert study.errors(method, material, LOW_VIEWS) is None
    reason = "no pair of directions can be seen (views below 50 degrees)"
    assert study.skipped == {("pca-own-4", reason): ["steep12"]}


def test_a_small_texture_has_few_components_of_its_own(study, tmp_path):
    write(texture(5, size=4), tmp_path / "small12.npz")
    (small,) = collect([tmp_path / "small12.npz"])
    study = replace(study, skipped={})
    for name in ("pca-own-8", "pca-own-16"):
        assert study.errors(find(name), small) is not None
    assert study.errors(find("pca-own-32"), small) is None
    reason = "there are only 16 principal components"
    assert study.skipped == {("pca-own-32", reason): ["small12"]}


def test_own_components_of_a_texture_are_better_than_those_of_others(study):
    for material in study.unseen:
        own, others = (study.errors(find(name), material).mse for name in ("pca-own-4", "pca-4"))
        assert own < others
