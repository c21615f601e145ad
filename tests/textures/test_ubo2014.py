"""`.btf` files: against files put together by hand, and against what pysmtb reads."""

from __future__ import annotations

import tracemalloc
from pathlib import Path

import numpy as np
import pytest

from nacre.btf import Btf, TableBtf
from nacre.errors import FormatError
from nacre.measured.textures import UTIA
from nacre.measured.textures.domes import below, pairs
from nacre.measured.textures.ubo2014 import FORMAT, ColorModel, load, save
from nacre.measured.textures.ubo2014.color_models import Decorrelation
from tests.cli.support import run
from tests.textures.ubo2014_file import FIELDS, btf_bytes, factors

DOME = UTIA.directions[below(UTIA.directions, 30.0)]


def made(width: int = 7, height: int = 5, rank: int = 6, seed: int = 0) -> TableBtf:
    """A colored texture whose logarithm is nearly of low rank, with highlights up to about 50."""
    random = np.random.default_rng(seed)
    wi, wo = pairs(DOME, DOME)
    weights = random.standard_normal((height * width, rank)) * 0.7 ** np.arange(rank)
    basis = random.standard_normal((rank, len(wi), 1)) + 0.1 * random.standard_normal((1, 1, 3))
    values = np.exp(np.tensordot(weights, basis, 1) - 1.0)
    return TableBtf(values.reshape(height, width, -1, 3).astype(np.float32), wi, wo, "made")


def written(path: Path, **changes: object) -> Path:
    path.write_bytes(btf_bytes(**changes))
    return path


def everything(btf: Btf) -> np.ndarray:
    return btf.texels(slice(None))


@pytest.mark.parametrize("scalar", [2, 4, 8])
@pytest.mark.parametrize("swapped", [False, True])
def test_values_are_products_of_the_matrices(tmp_path: Path, scalar: int, swapped: bool) -> None:
    btf = load(written(tmp_path / "x.btf", scalar=scalar, swapped=swapped))
    matrices = factors(FIELDS | {"swapped": swapped})
    expected = np.stack([u @ sxv.T for _, u, sxv in matrices], axis=-1)
    expected = expected if swapped else expected.swapaxes(0, 1)
    tolerance = 2e-3 if scalar == 2 else 1e-6
    np.testing.assert_allclose(everything(btf), expected, rtol=tolerance)
    assert (btf.width, btf.height, btf.pair_count, btf.name) == (4, 2, 6, "x")
    images = btf.images(np.array([4, 1]))
    np.testing.assert_allclose(images[0, 1, 2], expected[6, 4], rtol=tolerance)
    np.testing.assert_allclose(images[1, 1, 0], expected[4, 1], rtol=tolerance)


def test_the_light_is_the_fastest_of_a_pair(tmp_path: Path) -> None:
    btf = load(written(tmp_path / "x.btf"))
    theta, phi = np.array(FIELDS["views"])[2]
    view = np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)
    np.testing.assert_allclose(btf.wo[4:], [view, view], atol=1e-6)
    np.testing.assert_array_equal(btf.wi[:2], btf.wi[4:])
    np.testing.assert_allclose(btf.wi[1, 2], np.cos(1.0), rtol=1e-6)


def test_the_cosine_is_divided_out_where_it_is_in_the_data(tmp_path: Path) -> None:
    plain = load(written(tmp_path / "plain.btf"))
    lit = load(written(tmp_path / "lit.btf", cosine=1))
    ratio = 1.0 / plain.wi[:, 2, None]
    np.testing.assert_allclose(everything(lit), everything(plain) * ratio, rtol=1e-6)
    chosen = np.array([5, 2])
    expected = plain.images(chosen) * ratio[chosen, None, None]
    np.testing.assert_allclose(lit.images(chosen), expected, rtol=1e-6)


def test_what_a_header_says_is_kept(tmp_path: Path) -> None:
    header = load(written(tmp_path / "x.btf", names=(b"Y", b"U", b"V"))).header
    assert (header.setup, header.sensor, header.light_source) == ("dome", "camera", "LED")
    assert (header.xml, header.channels, header.pixels_per_mm) == ("<a>&b;</a>", tuple("YUV"), 9.5)
    assert header.rotations.shape == (1, 3, 3)
    assert load(written(tmp_path / "old.btf", version=1)).header.xml == ""


# Formulas of the color models as the reader of Bonn has them, for one color each

MODELS = {
    0: ((0.2, 0.3, 0.4), (0.2, 0.3, 0.4)),
    1: ((0.5, 0.1, -0.05), (0.4430085, 0.489565, 0.703211)),
    3: ((0.5, 0.1, 0.2), (0.6, 0.7, 0.5)),
    4: ((0.5, 0.1, -0.05), (0.65, 0.45, 0.45)),
    9: ((-0.7, 0.1, -0.05), (0.4395838, 0.4861403, 0.6997863)),
    10: ((-0.7, 9.0, -8.0), (0.4625974, 0.4819040, 0.6612388)),
    11: ((-0.7, 0.2, -0.1), (0.4399729, 0.4862136, 0.6983985)),
    12: ((-0.7, -1.0, 0.5), (0.4965753, 0.3678694, 1.6487113)),
}


@pytest.mark.parametrize("model", MODELS)
def test_color_models_are_those_of_the_reader_of_bonn(tmp_path: Path, model: int) -> None:
    channels, rgb = MODELS[model]
    ones = [[np.ones(1), np.ones((6, 1)), np.full((8, 1), value)] for value in channels]
    turned = (0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0)
    path = written(tmp_path / "x.btf", model=model, k=1, matrices=ones, matrix=turned, mean=_MEAN)
    np.testing.assert_allclose(everything(load(path))[3, 4], rgb, rtol=1e-5)


_MEAN = (0.4, 0.2, 0.4)


@pytest.mark.parametrize("model", ColorModel)
def test_color_models_invert(model: ColorModel) -> None:
    rgb = np.random.default_rng(1).uniform(0.001, 40.0, (3, 500)).astype(np.float32)
    matrix = np.random.default_rng(2).standard_normal((3, 3))
    colors = Decorrelation(model, (0.5, 0.4, 0.3), matrix)
    dropped = 2.1e-5 if model is ColorModel.YLOG_ULOG_VLOG else 0.0  # chroma below its epsilon
    back = colors.to_rgb(colors.from_rgb(rgb.copy()))
    np.testing.assert_allclose(back, rgb, rtol=1e-3, atol=dropped)


@pytest.mark.parametrize("model", ColorModel)
@pytest.mark.parametrize("scalar", [2, 4])
def test_a_texture_comes_back(tmp_path: Path, model: ColorModel, scalar: int) -> None:
    btf, path = made(), tmp_path / "x.btf"
    error = save(btf, path, 35, model, scalar).error
    back, values = load(path), everything(btf)
    assert back.header.colors.model is model
    np.testing.assert_allclose(back.wi, btf.wi, atol=2e-7)
    np.testing.assert_allclose(back.wo, btf.wo, atol=2e-7)
    assert error < (4e-3 if scalar == 2 else 1e-5)
    difference = np.abs(everything(back) - values).mean() / values.mean()
    np.testing.assert_allclose(difference, error, rtol=1e-4)


@pytest.mark.parametrize("components", [1, 3, 5])
def test_few_components_are_nearly_the_best(tmp_path: Path, components: int) -> None:
    btf, path = made(24, 20, rank=40), tmp_path / "x.btf"
    save(btf, path, components, ColorModel.LOG_RGB, 4)
    logarithms = np.log(everything(btf) + 1e-5)
    back = load(path)
    for channel in range(3):
        exact = logarithms[..., channel]
        left = np.linalg.svd(exact, compute_uv=False)[components:]
        pair, texel = (m.astype(np.float64) for m in back.factors(channel))
        error = np.linalg.norm(texel @ pair.T - exact)
        assert error < 1.01 * np.linalg.norm(left)


def test_pysmtb_reads_the_same(tmp_path: Path) -> None:
    """The reader of one of the authors of the format; it needs files without rotations."""
    pysmtb = pytest.importorskip("pysmtb.btf", reason="its reader is the oracle")
    btf, path = made(), tmp_path / "x.btf"
    save(btf, path, 9, scalar_size=4)
    meta, data = pysmtb.read_ubo_btf_dfmf(str(path))
    back = load(path)
    assert (meta.width, meta.height, meta.num_rotations) == (7, 5, 0)
    assert (meta.num_components, meta.color_model, meta.cosine_in_data) == (9, 11, 0)
    np.testing.assert_allclose(np.stack(meta.views_3d), DOME, atol=2e-7)
    assert meta.num_lights_per_view == [len(DOME)] * len(DOME)
    x, y = meta.lights_2d[3].T
    np.testing.assert_allclose([x, y], (DOME[:, :2] / (1.0 + DOME[:, 2:])).T, atol=2e-7)
    products = []
    for channel in range(3):
        pair, texel = back.factors(channel)
        np.testing.assert_array_equal(data.U[channel], pair)
        np.testing.assert_array_equal(data.SxV[channel], texel)
        norms = np.linalg.norm(texel.astype(np.float64), axis=0)
        np.testing.assert_allclose(data.S[channel], norms, rtol=1e-5)
        products.append(data.SxV[channel] @ data.U[channel].T)
    y, u, v = products
    luma = np.exp(y)
    rgb = [luma - 1e-5 + 1.13983 * v * luma, luma - 1e-5 - luma * (0.39465 * u + 0.5806 * v)]
    rgb.append(luma - 1e-5 + 2.03211 * u * luma)
    np.testing.assert_allclose(everything(back), np.maximum(np.stack(rgb, -1), 0), rtol=2e-4)


def test_pysmtb_reads_files_put_together_by_hand(tmp_path: Path) -> None:
    pysmtb = pytest.importorskip("pysmtb.btf", reason="its reader is the oracle")
    path = written(tmp_path / "x.btf", rotations=(), model=3)
    meta, data = pysmtb.read_ubo_btf_dfmf(str(path))
    back = load(path)
    np.testing.assert_array_equal(data.U[2], back.factors(2)[0])
    np.testing.assert_array_equal(data.SxV[2], back.factors(2)[1])
    np.testing.assert_array_equal(np.reshape(back.header.colors.matrix, (3, 3)), np.eye(3))
    np.testing.assert_allclose(meta.color_mean, back.header.colors.mean)


def test_rewriting_keeps_the_notes(tmp_path: Path) -> None:
    first = load(written(tmp_path / "x.btf", cosine=1, swapped=True))
    save(first, tmp_path / "y.btf", 6, ColorModel.RGB, 4)
    second = load(tmp_path / "y.btf")
    assert (second.header.xml, second.header.setup) == (first.header.xml, first.header.setup)
    assert not second.header.cosine
    np.testing.assert_array_equal(second.header.rotations, first.header.rotations)
    np.testing.assert_allclose(everything(second), everything(first), rtol=1e-4)


def test_notes_in_other_encodings_are_kept(tmp_path: Path) -> None:
    """Of old programs; a text that takes all the bytes there are must not grow."""
    notes = {"setup": b"K\xfchler ".ljust(80, b"\xff"), "xml": "<a>Köln</a>".encode("latin-1")}
    path = written(tmp_path / "x.btf", **notes, names=(b"\xff" * 80, b"G\n", b"B"))
    save(load(path), tmp_path / "y.btf", 6, ColorModel.RGB, 4)
    first, second = (p.read_bytes() for p in (path, tmp_path / "y.btf"))
    start = 18  # behind the size and version
    end = first.index(b"<a>K") + len(notes["xml"]) + 4 + 3 * 4 + 83
    assert second[start:end] == first[start:end]
    assert notes["setup"] in second
    assert run("info", path) == 0
    path.write_bytes(btf_bytes(names=(b"\xff", b"G", b"B"), scalar=3))
    assert run("info", path) == 2


def test_pairs_in_any_order_are_written(tmp_path: Path) -> None:
    whole = made()
    order = np.random.default_rng(0).permutation(whole.pair_count)[:40]
    some = TableBtf(whole.values[:, :, order], whole.wi[order], whole.wo[order])
    save(some, tmp_path / "x.btf")
    back = load(tmp_path / "x.btf")
    np.testing.assert_allclose(back.wi, some.wi, atol=2e-7)
    np.testing.assert_allclose(everything(back), everything(some), rtol=0.05, atol=0.01)


def test_the_same_texture_gives_the_same_bytes(tmp_path: Path) -> None:
    for name in ("a.btf", "b.btf"):
        save(made(), tmp_path / name, 4)
    assert (tmp_path / "a.btf").read_bytes() == (tmp_path / "b.btf").read_bytes()


def test_progress_is_told_up_to_the_end(tmp_path: Path) -> None:
    told: list[tuple[int, int]] = []
    save(
        made(),
        tmp_path / "x.btf",
        2,
        ColorModel.PCA,
        progress=lambda stage, done, total, note: told.append((done, total)),
    )
    assert told == [(35 * n, 35 * 5) for n in range(1, 6)]


def with_value(value: float) -> TableBtf:
    btf = made()
    btf.values[2, 3, 4, 1] = value
    return btf


def below_horizon() -> TableBtf:
    btf = made()
    btf.wi[3] *= -1.0
    return btf


@pytest.mark.parametrize(
    ("btf", "model", "words"),
    [
        (with_value(np.nan), ColorModel.RGB, "texels 0 to 34 hold values that are not finite"),
        (with_value(np.inf), ColorModel.LOG_RGB, "not finite"),
        (with_value(1e6), ColorModel.RGB, "too large for numbers of 2 bytes; take more"),
        (below_horizon(), ColorModel.RGB, "a light is not above the horizon"),
    ],
)
def test_what_cannot_be_written_leaves_nothing(
    tmp_path: Path, btf: TableBtf, model: ColorModel, words: str
) -> None:
    with pytest.raises(FormatError, match=words):
        save(btf, tmp_path / "x.btf", model=model)
    assert not list(tmp_path.iterdir())


REFUSED = {
    "magic": (b"!FMF12FCER", "does not start with"),
    "size": (0, "header size 0"),
    "version": (5, "version 5"),
    "cosine": (2, "cosine flag 2"),
    "xml_size": (2**32 - 1, "bytes of XML"),
    "channel_count": (1, "1 channels"),
    "name_size": (2**32 - 1, "channel name of"),
    "view_count": (0, "0 views"),
    "light_count": (0, "of 0 lights"),
    "width": (0, "0 x 2 texels"),
    "height": (2**32 - 1, "texels"),
    "rotation_count": (2**32 - 1, "ends within the rotations"),
    "most": (1, "2 components, expected 1 to 1"),
    "model": (2, "color model 2 is not read"),
    "scalar": (3, "numbers of 3 bytes"),
    "k_stated": (7, "7 components, expected 1 to 2"),
    "rows": (5, "matrix of 5 x 8, expected 6 pairs x 8 texels"),
    "columns": (12, "matrix of 6 x 12"),
    "per_mm": (np.nan, "pixels per mm"),
    "scale": ((1.0, np.inf, 1.0), "RGB scale"),
    "views": (((0.0, 0.0), (0.1, 0.0), (1.6, 0.0)), "polar angle 91.67.* of a view"),
    "lights": (((0.0, 0.0), (-0.1, 0.0)), "polar angle -5.7.* of a light"),
    "rotations": (((np.nan,) * 9,), "rotations: not finite"),
    "mean": ((np.nan,) * 3, "color mean"),
    "end": (b"\0", "the file is damaged"),
}


@pytest.mark.parametrize("field", REFUSED)
def test_each_field_is_checked(tmp_path: Path, field: str) -> None:
    value, words = REFUSED[field]
    path = written(tmp_path / "x.btf", **{field: value})
    with pytest.raises(FormatError, match=words) as caught:
        FORMAT.load(path)
    assert str(caught.value).startswith(f"{path}: ")


@pytest.mark.parametrize("part", [1, 2])
@pytest.mark.parametrize("scalar", [2, 4, 8])
@pytest.mark.parametrize("value", [np.nan, -np.inf, 1e9])
def test_numbers_out_of_bounds_are_refused(
    tmp_path: Path, part: int, scalar: int, value: float
) -> None:
    matrices = factors(FIELDS)
    matrices[1][part][0, 1] = value
    path = written(tmp_path / "x.btf", scalar=scalar, matrices=matrices)
    with pytest.raises(FormatError, match=r"channel 'G': matrix (U|SxV): holds numbers"):
        load(path)


def test_more_components_than_directions_are_refused(tmp_path: Path) -> None:
    path = written(tmp_path / "x.btf", k=7, most=7)
    with pytest.raises(FormatError, match="7 components, expected 1 to 6"):
        load(path)


def test_matrices_of_another_texture_are_refused(tmp_path: Path) -> None:
    wide = factors(FIELDS | {"width": 5})
    path = written(tmp_path / "x.btf", matrices=wide)
    with pytest.raises(FormatError, match="matrix of 6 x 10, expected 6 pairs x 8 texels"):
        load(path)


def test_a_file_cut_anywhere_is_refused(tmp_path: Path) -> None:
    content = btf_bytes()
    for length in np.linspace(1, len(content) - 1, 20).astype(int):
        (tmp_path / "x.btf").write_bytes(content[:length])
        with pytest.raises(FormatError):
            load(tmp_path / "x.btf")


@pytest.mark.parametrize(("width", "height"), [(1 << 31, 1), (46341, 46341), (1 << 13, 1 << 13)])
def test_a_claim_of_many_texels_takes_no_memory(tmp_path: Path, width: int, height: int) -> None:
    path = written(tmp_path / "x.btf", width=width, height=height, columns=width * height)
    tracemalloc.start()
    try:
        with pytest.raises(FormatError, match=r"texels|ends within"):
            load(path)
        assert tracemalloc.get_traced_memory()[1] < 1 << 20
    finally:
        tracemalloc.stop()


def test_reading_takes_memory_for_what_is_asked_for(tmp_path: Path) -> None:
    """4,096 pairs of 4,096 texels take 200 MB when decoded."""
    shape = {"width": 64, "height": 64, "views": FIELDS["views"][:1] * 64}
    shape["lights"] = FIELDS["lights"][:1] * 64
    path = written(tmp_path / "x.btf", **shape, matrices=factors(FIELDS | shape), scalar=2)
    tracemalloc.start()
    try:
        btf = load(path)
        assert btf.texels(slice(0, 5)).shape == (5, 4096, 3)
        assert btf.images(slice(0, 5)).shape == (5, 64, 64, 3)
        assert tracemalloc.get_traced_memory()[1] < 10 << 20
    finally:
        tracemalloc.stop()


def test_an_empty_file_is_refused_as_empty(tmp_path):
    path = tmp_path / "a.btf"
    path.touch()
    with pytest.raises(FormatError, match="is empty"):
        load(path)
    path.write_bytes(b"B")
    with pytest.raises(FormatError) as caught:
        load(path)
    assert "is empty" not in str(caught.value)
