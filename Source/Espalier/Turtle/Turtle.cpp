#include <Espalier/Turtle/Turtle.h>

#include <Espalier/Core/Json.h>
#include <Espalier/Plant/Skeleton.h>
#include <Espalier/Turtle/TurtleKernel.h>
#include <algorithm>
#include <cmath>
#include <utility>

namespace espalier {

TurtleSettings turtleSettings(const Grammar& grammar)
{
    return {grammar.angle, grammar.step, grammar.width, grammar.width != TurtleSettings{}.width, grammar.tropism};
}

/// Writes what a turtle draws into a skeleton.
class SkeletonPen
{
public:
    explicit SkeletonPen(Turtle& turtle)
        : turtle_(&turtle), limits_(&turtle.limits_), scratch_(&turtle.scratch_), skeleton_(&turtle.skeleton_)
    {}

    [[nodiscard]] bool collectsCorners() const { return !scratch_->polygons.empty(); }
    [[nodiscard]] bool hasRoom(bool draws) const
    {
        return (!draws || roomForSegments() > 0) && (!collectsCorners() || roomForCorners() > 0);
    }
    [[nodiscard]] std::size_t room() const
    {
        return collectsCorners() ? std::min(roomForSegments(), roomForCorners()) : roomForSegments();
    }
    bool makeRoom(bool draws)
    {
        return draws && roomForSegments() == 0
                   ? fail("the plant has more than " + std::to_string(limits_->nodes) + " segments",
                          "at most the limit nodes")
                   : failOfCorners();
    }

    std::uint32_t segment(const TurtleStroke& stroke, std::uint32_t parent, std::uint16_t material)
    {
        const std::uint32_t index = skeleton_->size();
        const Vec3 heading(stroke.heading);
        skeleton_->starts.push_back({stroke.start[0], stroke.start[1], stroke.start[2]});
        skeleton_->ends.push_back({stroke.end[0], stroke.end[1], stroke.end[2]});
        skeleton_->headings.push_back(stroke.length < 0 ? -heading : heading);
        skeleton_->lefts.push_back(Vec3(stroke.left));
        skeleton_->lengths.push_back(static_cast<float>(std::abs(stroke.length)));
        skeleton_->startRadii.push_back(stroke.start[3]);
        skeleton_->endRadii.push_back(stroke.start[3]);
        skeleton_->parents.push_back(parent);
        skeleton_->continuations.push_back(kNoSegment);
        skeleton_->orders.push_back(0);
        skeleton_->materials.push_back(material);
        skeleton_->instances.push_back(scratch_->instances.empty() ? kNoSegment : scratch_->instances.back());
        return index;
    }

    void reach(const TurtleVector& position)
    {
        const DVec3 p(position);
        turtle_->minY_ = std::min(turtle_->minY_, p.y);
        turtle_->maxY_ = std::max(turtle_->maxY_, p.y);
        turtle_->maxRadiusSquared_ = std::max(turtle_->maxRadiusSquared_, p.x * p.x + p.z * p.z);
    }

    void corner(simd::Four position) { scratch_->corners.push_back({position[0], position[1], position[2]}); }

    void beginPolygon() { scratch_->polygons.push_back(static_cast<std::uint32_t>(scratch_->corners.size())); }

    bool mark(const TurtleVector& position)
    {
        if (scratch_->polygons.empty())
            return true;
        if (roomForCorners() == 0)
            return failOfCorners();
        scratch_->corners.push_back(Vec3(position));
        return true;
    }

    void endPolygon(const TurtlePlace& place)
    {
        const std::uint32_t first = scratch_->polygons.back();
        scratch_->polygons.pop_back();
        const auto count = static_cast<std::uint32_t>(scratch_->corners.size()) - first;
        if (count >= 3)
        {
            skeleton_->polygons.push_back(
                {static_cast<std::uint32_t>(skeleton_->corners.size()), count, place.segment, place.material});
            skeleton_->corners.insert(skeleton_->corners.end(), scratch_->corners.begin() + first,
                                      scratch_->corners.end());
        }
        scratch_->corners.resize(first);
    }

    bool sphere(const TurtlePlace& place, double radius)
    {
        if (skeleton_->spheres.size() >= limits_->nodes)
            return fail("the plant has more than " + std::to_string(limits_->nodes) + " spheres",
                        "at most the limit nodes");
        if (radius > limits_->coordinate)
            return fail("a sphere is larger than " + formatNumber(limits_->coordinate) + " m",
                        "at most the limit coordinate");
        skeleton_->spheres.push_back({Vec3(place.position), static_cast<float>(radius), place.segment, place.material});
        return true;
    }

    bool organ(const TurtlePlace& place, const TurtleAxes& axes, std::uint32_t which, double size)
    {
        if (skeleton_->organs.size() >= limits_->nodes)
            return fail("the plant has more than " + std::to_string(limits_->nodes) + " organs",
                        "at most the limit nodes");
        if (size > limits_->coordinate)
            return fail("an organ is larger than " + formatNumber(limits_->coordinate) + " m",
                        "at most the limit coordinate");
        skeleton_->organs.push_back({Vec3(place.position), Vec3(axes.heading), Vec3(axes.left),
                                     static_cast<float>(size), which, place.segment, place.material});
        return true;
    }

    void widthSet() { skeleton_->widthsGiven = true; }

private:
    [[nodiscard]] std::size_t roomForSegments() const
    {
        return limits_->nodes - std::min<std::size_t>(skeleton_->size(), limits_->nodes);
    }
    [[nodiscard]] std::size_t roomForCorners() const
    {
        const std::size_t corners = scratch_->corners.size() + skeleton_->corners.size();
        return limits_->vertices - std::min<std::size_t>(corners, limits_->vertices);
    }
    bool failOfCorners()
    {
        return fail("the polygons have more than " + std::to_string(limits_->vertices) + " corners",
                    "at most the limit vertices");
    }
    bool fail(std::string what, std::string expected)
    {
        turtle_->error_ = {ErrorKind::Limit, std::move(what), std::move(expected), {}, {}};
        return false;
    }

    Turtle* turtle_;
    const Limits* limits_;
    TurtleScratch* scratch_;
    Skeleton* skeleton_;
};

Turtle::Turtle(const TurtleSettings& settings, const Limits& limits, TurtleScratch& scratch, Skeleton& skeleton)
    : limits_(limits), settings_(settings), scratch_(scratch), skeleton_(skeleton)
{
    skeleton_.clear();
    skeleton_.widthsGiven = settings.widthIsGiven;
    scratch_.instances.clear();
    scratch_.corners.clear();
    scratch_.polygons.clear();
    scratch_.begin(settings.angleDegrees);
    scratch_.places[0].position.high[1] = 0.5 * settings.width;
}

bool Turtle::apply(TurtleCommand command, std::span<const double> parameters)
{
    // Letters 2c and 2c + 1 are command c without and with a parameter.
    constexpr int kCommands = static_cast<int>(TurtleCommand::Sphere) + 1;
    static const TurtleAlphabet everyCommand = [] {
        std::vector<TurtleCommand> commands;
        std::vector<std::uint8_t> arities;
        for (int i = 0; i < 2 * kCommands; ++i)
        {
            commands.push_back(static_cast<TurtleCommand>(i / 2));
            arities.push_back(static_cast<std::uint8_t>(i % 2));
        }
        return TurtleAlphabet(commands, arities, std::vector<SymbolId>(commands.size(), 0));
    }();
    const auto letter = static_cast<LetterId>(2 * static_cast<int>(command) + !parameters.empty());
    return apply(everyCommand, {&letter, 1}, parameters);
}

bool Turtle::apply(const TurtleAlphabet& alphabet, std::span<const LetterId> letters, std::span<const double> arguments)
{
    if (failed_)
        return false;
    SkeletonPen pen(*this);
    TurtleKernel<SkeletonPen> kernel(settings_, limits_, scratch_, state_, pen);
    const std::size_t done = kernel.run(alphabet, letters, arguments.data());
    applied_ += done;
    if (done == letters.size())
        return true;
    ++applied_;
    return fail(kernel.error);
}

bool Turtle::fail(const Error& error)
{
    failed_ = true;
    if (!error.what.empty())
        error_ = error;
    error_.what = "module " + std::to_string(applied_) + " of the word: " + error_.what;
    return false;
}

void Turtle::beginInstance(std::uint32_t production, std::uint32_t row)
{
    const std::uint32_t parent = scratch_.instances.empty() ? kNoSegment : scratch_.instances.back();
    scratch_.instances.push_back(static_cast<std::uint32_t>(skeleton_.instanceRecords.size()));
    skeleton_.instanceRecords.push_back({parent, production, row});
}

void Turtle::endInstance()
{
    scratch_.instances.pop_back();
}

Expected<void> Turtle::finish()
{
    SkeletonPen pen(*this);
    const TurtleKernel<SkeletonPen> kernel(settings_, limits_, scratch_, state_, pen);
    if (auto unfinished = kernel.unfinished(applied_); unfinished && !failed_)
    {
        failed_ = true;
        error_ = std::move(*unfinished);
    }
    if (failed_)
    {
        skeleton_.clear();
        return tl::make_unexpected(error_);
    }
    skeleton_.minY = static_cast<float>(minY_);
    skeleton_.maxY = static_cast<float>(maxY_);
    skeleton_.maxRadius = static_cast<float>(std::sqrt(maxRadiusSquared_));
    return {};
}

} // namespace espalier
