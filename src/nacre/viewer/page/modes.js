// The modes of the page, in the order of their tabs.
//
// A mode has a title, a panel (an element beside the picture), available() (whether the page holds
// something for it), open(), close(), changed() (another material or form is chosen), draw() (what is
// new, on the picture; returns a word on its state), and, if it wants, lit(change) (the scene changed).
// One that needs no material has a static alone, true.

import { Compare } from "./compare.js";
import { Lobes } from "./lobes.js";
import { Look } from "./look.js";
import { Space } from "./space.js";
import { Textures } from "./textures.js";

export const MODES = [Look, Compare, Lobes, Space, Textures];
