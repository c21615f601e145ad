"""A page of sliders that move a material along named directions."""

from __future__ import annotations

import base64
import html
import io
from collections.abc import Callable, Sequence
from string import Template

import numpy as np

from nacre.figures.code_views import strip
from nacre.latent.basis import CodedBrdf
from nacre.latent.edits import Edit
from nacre.runtime.progress import Progress, silent

REACH = 2.0
"""Amount at the ends of a strip or a slider; 0 is in the middle."""
_QUALITY = 90

_PAGE = Template("""\
<!doctype html>
<html lang="en">
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; img-src data:;
  style-src 'unsafe-inline'; script-src 'unsafe-inline'">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>$title</title>
<style>
:root { color-scheme: light dark; font: 15px/1.5 system-ui, sans-serif; }
body { margin: 24px; background: light-dark(#f6f5f2, #16171a); }
body { color: light-dark(#1d1f23, #eceae6); }
main { display: grid; gap: 24px; grid-template-columns: repeat(auto-fill, minmax(${size}px, 1fr)); }
h1 { font-size: 20px; overflow-wrap: anywhere; }
h2 { font-size: 15px; margin: 8px 0 0; }
p { margin: 0; color: light-dark(#5a5e66, #a9adb5); font-size: 13px; }
input { width: 100%; accent-color: light-dark(#1f5f8b, #7dbbe6); }
.picture { width: ${size}px; height: ${size}px; border-radius: 6px; }
.ends { display: flex; justify-content: space-between; }
</style>
<h1>$title</h1>
<main>
$cards</main>
<script>
for (const card of document.querySelectorAll("section")) {
  const slider = card.querySelector("input");
  const picture = card.querySelector(".picture");
  const caption = card.querySelector("output");
  const captions = caption.dataset.captions.split("\\n");
  const show = () => {
    picture.style.backgroundPositionX = `$${-slider.value * $size}px`;
    caption.textContent = captions[slider.value];
    slider.setAttribute("aria-valuetext", captions[slider.value]);
  };
  slider.addEventListener("input", show);
  show();
}
</script>
</html>
""")
_CARD = Template("""\
<section>
<div class="picture" role="img" aria-label="$name" style="background-image: url($data)"></div>
<h2 id="$id">$name</h2>
<input type="range" min="0" max="$last" value="$middle" aria-labelledby="$id">
<p class="ends"><span>$opposite</span><span>$name</span></p>
<p><output data-captions="$captions"></output></p>
<p>$about</p>
</section>
""")


def moved(material: CodedBrdf, edit: Edit, count: int) -> list[CodedBrdf]:
    """A material at `count` even steps along a direction, from end to end."""
    amounts = np.linspace(-REACH, REACH, count)
    codes = [edit.apply(material.code, amount) for amount in amounts]
    return [
        material.basis.decode(code, f"{material.name} {edit.name} {amount:+.2f}")
        for amount, code in zip(amounts, codes, strict=True)
    ]


def slider_page(
    name: str,
    edits: Sequence[Edit],
    rows: Sequence[Sequence[CodedBrdf]],
    caption: Callable[[CodedBrdf], str],
    size: int,
    spp: int | None,
    progress: Progress = silent,
) -> bytes:
    """A page, in UTF-8, that needs no other file and no network.

    Parameters
    ----------
    name
        Of the material.
    edits, rows
        Directions, one per slider, and the materials along each (:func:`moved`).
    caption
        Makes a line about a material, shown below its picture.
    size, spp
        For previews: edge in pixels, and samples per pixel, with a default for None.

    Raises
    ------
    MissingExtraError
        If Mitsuba is not installed.
    """
    from PIL import Image

    cards = []
    for index, (edit, row) in enumerate(zip(edits, rows, strict=True)):
        stream = io.BytesIO()
        picture = strip(row, size, spp, lambda *_: None)
        Image.fromarray(picture).save(stream, "JPEG", quality=_QUALITY, subsampling=0)
        progress("rendering", index + 1, len(edits), edit.name)
        cards.append(
            _CARD.substitute(
                id=f"direction{index}",
                name=html.escape(edit.name),
                opposite=html.escape(edit.opposite),
                about=html.escape(edit.about),
                data="data:image/jpeg;base64," + base64.b64encode(stream.getvalue()).decode(),
                captions=html.escape("\n".join(caption(material) for material in row)),
                last=len(row) - 1,
                middle=len(row) // 2,
            )
        )
    page = _PAGE.substitute(title=html.escape(name), size=size, cards="".join(cards))
    return page.encode()
