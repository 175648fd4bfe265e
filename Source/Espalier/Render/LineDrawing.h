#pragma once

#include <Espalier/Mesh/TubeMesher.h>

namespace espalier {

struct Appearance;
struct Skeleton;
struct RenderSettings;

// Many L-systems of the textbooks are line drawings and no trees: the Koch curve, the dragon, Sierpinski's triangle.
// They are meant to show their corners, and a line of the width that suits one step is far thinner than a pixel when
// hundreds of steps fill the picture.

/// Tubes as lines: straight between sharp corners, without collars and roots.
[[nodiscard]] TubeSettings lineTubes();

/// Turns axes into strokes: each of one colour, without a gap, and as wide at its tip as before it. A tube has one
/// colour, that of its first segment, so an axis ends where another colour begins, and what grew there starts anew.
void divideIntoStrokes(Skeleton& skeleton);

/// Colours for lines on paper: bark is drawn in nearly black ink, and the palette is deepened, as a line that covers
/// its pixels in part looks paler than it is.
void dipInInk(Appearance& appearance);

/// Sets radii to what is drawn about `pixels` wide when renderPicture shows the whole of this plant, before it is
/// meshed; where the turtle was given widths, raises those that are less. On sheets and turntables, which share one
/// scale, the smaller plants' lines are thinner. Nothing happens for pixels <= 0.
void thickenLines(Skeleton& skeleton, float pixels, const RenderSettings& settings);

} // namespace espalier
