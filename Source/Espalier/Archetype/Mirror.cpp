#include <Espalier/Archetype/Mirror.h>

#include <cmath>

namespace espalier {

namespace {

char mirrored(char symbol)
{
    switch (symbol)
    {
    case '+':
        return '-';
    case '-':
        return '+';
    case '\\':
        return '/';
    case '/':
        return '\\';
    default:
        return symbol;
    }
}

/// The rotation that makes a mirrored instance point as far to one side as the drawn one to the other. It moves a turn
/// of t degrees to t + rotation; that turn stays t in the mirror, and is to become -(t + rotation).
double mirroredRotation(const Template& piece, const InstanceTransform& transform)
{
    if (!beginsWithTurn(piece))
        return 0 - transform.rotation; // 0 stays 0, not -0
    const double turn = piece.modules[0].hasNumber ? piece.modules[0].number : transform.branchingAngle;
    const double rotation = 0 - transform.rotation - 2 * turn;
    return std::abs(rotation) > 360 ? std::remainder(rotation, 360.0) : rotation; // within what files may hold
}

} // namespace

Template mirrorImage(const Template& piece)
{
    Template image = piece;
    for (std::size_t i = beginsWithTurn(piece) ? 1 : 0; i < image.modules.size(); ++i)
        if (image.modules[i].anchor == kNoAnchor)
            image.modules[i].symbol = mirrored(image.modules[i].symbol);
    if (image != piece)
        image.name += kMirrored;
    return image;
}

Archetype mirrorImage(const Archetype& archetype)
{
    Archetype image = archetype;
    for (Template& piece : image.library.templates)
        piece = mirrorImage(piece);
    for (TemplateInstance& instance : image.instances)
    {
        const Template& piece = archetype.library.templates[instance.piece];
        instance.transform.rotation = mirroredRotation(piece, instance.transform);
        instance.transform.roll = 0 - instance.transform.roll;
    }
    return image;
}

} // namespace espalier
