from __future__ import annotations

from pathlib import Path

from nacre.cli import options
from nacre.cli.command import command as make
from nacre.cli.options import option
from nacre.cli.report import print_table, progress, report
from nacre.errors import NacreError


@make(
    "map",
    options.inputs_argument(),
    options.output_option("Plot to write (.png, .svg, .pdf)."),
    options.basis_option(),
    option("--highlight", options.INPUT, multiple=True),
    "Material among INPUT to ring in red and list the neighbors of. May be repeated.",
    options.seed_option(),
)
def command(
    paths: tuple[Path, ...], output: Path, basis_name: str, highlight: tuple[Path, ...], seed: int
) -> None:
    """Draw a map (t-SNE) of materials or codes, similar ones close together."""
    from nacre.figures.code_views import coded, draw_map
    from nacre.figures.plot import check_plot_path, write_plot
    from nacre.latent import find_basis
    from nacre.latent.map import nearest

    check_plot_path(output)
    options.check_outputs([output], [*paths, Path(basis_name)])
    missing = [path for path in highlight if path not in paths]
    if missing:
        raise NacreError(f"{missing[0]}: cannot be highlighted, since it is not among the inputs")
    line = progress(output.stem)
    basis = find_basis(basis_name)
    names = [path.stem for path in paths]
    materials = coded(paths, basis, line)
    figure = draw_map(names, materials, {path.stem for path in highlight}, seed, line)
    write_plot(figure, output)
    codes = [material.code for material in materials]
    near = {
        str(path): [names[k] for k in nearest(codes, paths.index(path), 3)] for path in highlight
    }
    if near:
        rows = [(Path(path).stem, ", ".join(found)) for path, found in near.items()]
        print_table(("material", "nearest"), rows)
    data = {"output": str(output), "materials": len(paths), "nearest": near}
    report(f"{output}: {len(paths)} materials", data)
