// Based on: H. Vogel, "A better way to construct the sunflower head", Mathematical Biosciences 44, 1979 (the divergence
// of 137.5 degrees; ABOP chapter 4), and, for several branches at one height, R. Jean, "Phyllotaxis", 1994 (multijugate
// patterns). Departure: templates bear branches in twos and threes whose places in the word are fixed, so the angle is
// between the instances that bear them, not between single branches.
//
// Rejected: rolling the child at a branch's anchor. The branch's first segments belong to the parent, so they would
// stay in the plane. Rejected too: templates of their own for each azimuth, which would keep the axis' course exactly,
// but leave no two limbs of one template, and so no kin.

#include <Espalier/Archetype/Spatial.h>

#include <Espalier/Archetype/Placement.h>
#include <Espalier/Core/DeterministicMath.h>
#include <Espalier/Core/Random.h>
#include <Espalier/Core/Vector.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace espalier {

namespace {

constexpr double kDivergence = 137.5; ///< Degrees; 360 / golden ratio^2.
/// Degrees, of a limb's first branch from the plane of the limb and its mother axis: across it, as the first leaves of
/// shoots stand. Were all limbs to begin so, a tree of two or three orders became narrow, the thesis' tree 3 m by 6 m;
/// as each next limb begins a divergence further it is 6 m by 4 m.
constexpr double kFirst = 90;
constexpr double kUsualAngle = 25; ///< Degrees; of a roll without a number, as the turtle has it.
constexpr double kNothing = 1e-6;  ///< Sine of what counts as no angle.
constexpr Seed kPlaces{0x617a696d757468u};

constexpr std::array<std::pair<std::string_view, Azimuths>, 3> kNames{
    {{"drawn", Azimuths::AsDrawn}, {"phyllotaxis", Azimuths::Phyllotaxis}, {"random", Azimuths::Random}}};

/// `v` turned about a unit axis.
DVec3 turned(const DVec3& v, const DVec3& about, double degrees)
{
    const auto [sin, cos] = math::sinCosDegrees(degrees);
    return v * cos + glm::cross(about, v) * sin + about * (glm::dot(about, v) * (1 - cos));
}

/// The part of `v` across a unit heading.
DVec3 across(const DVec3& v, const DVec3& heading)
{
    return v - heading * glm::dot(v, heading);
}

/// Angle from `from` to `to` about a unit heading, in the sense of a roll to the right, degrees. Both lie across it.
double azimuthBetween(const DVec3& from, const DVec3& to, const DVec3& heading)
{
    return math::atan2(glm::dot(glm::cross(from, to), heading), glm::dot(from, to)) / math::kRadiansPerDegree;
}

/// In (-180, 180], hundredths: so that rules read well.
double tidied(double degrees)
{
    const double near = std::round(100 * std::remainder(degrees, 360.0)) / 100;
    return near <= -180 ? near + 360 : near + 0.0; // no -0
}

/// Where a turtle points, and the direction that azimuths about its axis are counted from.
struct Bearing
{
    DVec3 heading{0, 1, 0};
    DVec3 left{-1, 0, 0};
    DVec3 reference{1, 0, 0}; ///< Across the heading; carried along the axis, and not rolled.

    void turn(TurtleCommand command, double degrees)
    {
        const DVec3 up = glm::cross(heading, left);
        switch (command)
        {
        case TurtleCommand::TurnLeft:
            return bend(up, degrees);
        case TurtleCommand::TurnRight:
            return bend(up, -degrees);
        case TurtleCommand::PitchDown:
            return bend(left, degrees);
        case TurtleCommand::PitchUp:
            return bend(left, -degrees);
        case TurtleCommand::TurnAround:
            return bend(up, 180);
        case TurtleCommand::RollLeft:
            left = turned(left, heading, -degrees);
            return;
        case TurtleCommand::RollRight:
            left = turned(left, heading, degrees);
            return;
        case TurtleCommand::Level:
            if (const DVec3 level = glm::cross(DVec3(0, 1, 0), heading); glm::length(level) > kNothing)
                left = level / glm::length(level);
            return;
        default:
            return;
        }
    }

private:
    void bend(const DVec3& about, double degrees)
    {
        heading = turned(heading, about, degrees);
        left = turned(left, about, degrees);
        reference = turned(reference, about, degrees);
    }
};

/// An axis as the walk has it.
struct Axis
{
    Bearing bearing;
    std::uint32_t order = 0;
    std::uint32_t branches = 0; ///< That left it so far.
    std::uint32_t pieces = 0;   ///< Instances on it so far that bear branches.
    std::uint32_t number = 0;   ///< Among the branches of its mother axis.
    double azimuth = 0;         ///< Of the last piece, degrees from the reference.
    bool isMoved = false;       ///< It or what bears it is no longer where it was drawn.
    DVec3 mother{0};            ///< Heading of the mother axis where this one left it, while it has drawn nothing.
    bool hasBegun = true;       ///< False: there is no reference yet.

    /// Counts azimuths from where the mother axis leads.
    void begin()
    {
        if (std::exchange(hasBegun, true))
            return;
        const DVec3 reference = across(mother, bearing.heading);
        const double length = glm::length(reference);
        bearing.reference = length > kNothing ? reference / length : bearing.left;
    }
};

/// Where an instance's branches stand round its axis, as its word has them.
struct Whorl
{
    std::uint32_t sides = 0; ///< 0: it bears none.
    double azimuth = 0;      ///< Of the first, degrees from the reference.
};

/// The branches of an axis that leave in one template, until it is known where the axis itself leads from there.
struct Leaving
{
    Bearing bearing;           ///< Of the axis, before them.
    std::vector<DVec3> toward; ///< Their headings.
};

class DepthGiver
{
public:
    DepthGiver(Archetype& archetype, std::span<const Azimuths> azimuths)
        : archetype_(archetype), anchors_(anchorsOf(archetype)), azimuths_(azimuths),
          placed_(placedTemplates(archetype)), rises_(archetype.instances.size())
    {}

    /// Finds out how much each instance rises as drawn, then gives the tree depth.
    void give(std::uint32_t tree)
    {
        walk(tree, true);
        walk(tree, false);
    }

private:
    struct Visit
    {
        std::uint32_t instance;
        RandomKey place;
        std::size_t position;
    };

    void walk(std::uint32_t tree, bool isDrawn)
    {
        isDrawn_ = isDrawn;
        axes_.assign(1, {});
        filter_ = {};
        enter(anchors_.roots[tree], RandomKey(kPlaces).child(tree));
        while (!visits_.empty())
        {
            Visit& visit = visits_.back();
            const TemplateInstance& instance = archetype_.instances[visit.instance];
            const std::vector<PlacedModule>& word = placed_[instance.piece];
            if (visit.position == word.size())
            {
                visits_.pop_back();
                continue;
            }
            const PlacedModule& module = word[visit.position++];
            if (module.anchor != kNoAnchor)
            {
                if (const std::uint32_t child = childAt(visit.instance, module.anchor); child != kNoInstance)
                    enter(child, visit.place.child(static_cast<std::uint64_t>(
                                     archetype_.library.templates[instance.piece].anchors[module.anchor])));
                continue;
            }
            if (filter_.carriesOut(module.command))
                apply(module, instance.transform);
        }
    }

    [[nodiscard]] std::uint32_t childAt(std::uint32_t instance, std::uint32_t anchor) const
    {
        return anchors_.children[anchors_.firstChild[instance] + anchor];
    }

    static double angleOf(const PlacedModule& module, const InstanceTransform& transform)
    {
        return module.source == ParameterSource::None ? kUsualAngle : parameterValue(module, transform);
    }

    void apply(const PlacedModule& module, const InstanceTransform& transform)
    {
        if (module.command == TurtleCommand::Push)
        {
            Axis& mother = axes_.back();
            Axis branch;
            branch.bearing = mother.bearing;
            branch.order = mother.order + 1;
            branch.number = mother.branches++;
            branch.mother = mother.bearing.heading;
            branch.isMoved = mother.isMoved;
            branch.hasBegun = false;
            axes_.push_back(branch);
        }
        else if (module.command == TurtleCommand::Pop)
            axes_.pop_back();
        else if (module.command == TurtleCommand::Draw)
            axes_.back().begin();
        else
            axes_.back().bearing.turn(module.command, angleOf(module, transform));
    }

    /// Where the axis gets to in an instance, from where it starts.
    [[nodiscard]] DVec3 courseOf(std::uint32_t index, Bearing bearing, const InstanceTransform& transform) const
    {
        DVec3 course(0);
        std::uint32_t depth = 0;
        TurtleFilter filter;
        for (const PlacedModule& module : placed_[archetype_.instances[index].piece])
        {
            if (module.anchor != kNoAnchor || !filter.carriesOut(module.command))
                continue;
            depth += module.command == TurtleCommand::Push ? 1 : 0;
            depth -= module.command == TurtleCommand::Pop ? 1 : 0;
            if (depth > 0)
                continue;
            if (module.command == TurtleCommand::Draw || module.command == TurtleCommand::Move)
                course += bearing.heading * parameterValue(module, transform);
            else
                bearing.turn(module.command, angleOf(module, transform));
        }
        return course;
    }

    /// The rotation, nearest to that of `transform`, with which an instance rises as much as it was drawn to, or as
    /// nearly as its plane allows.
    [[nodiscard]] double rotationThatRises(std::uint32_t index, const Bearing& start, InstanceTransform transform) const
    {
        const std::vector<PlacedModule>& word = placed_[archetype_.instances[index].piece];
        const bool turnsRight = word.size() > 1 && word[1].command == TurtleCommand::TurnRight;
        const double given = transform.rotation;
        transform.rotation = 0;
        const DVec3 course = courseOf(index, start, transform);
        Bearing rolled = start;
        rolled.turn(TurtleCommand::RollRight, transform.roll);
        const DVec3 up = glm::cross(rolled.heading, rolled.left);
        // Turned to the left by t it rises by constant + most * cos(t - best).
        const double constant = up.y * glm::dot(course, up);
        const double x = course.y - constant;
        const double y = glm::cross(up, course).y;
        const double most = std::sqrt(x * x + y * y);
        if (most <= kNothing * transform.scaling)
            return given;
        const double best = math::atan2(y, x) / math::kRadiansPerDegree;
        const double off =
            math::acos(std::clamp((rises_[index] - constant) / most, -1.0, 1.0)) / math::kRadiansPerDegree;
        const double sign = turnsRight ? -1 : 1;
        const double less = std::remainder(sign * (best - off) - given, 360.0);
        const double more = std::remainder(sign * (best + off) - given, 360.0);
        return given + (std::abs(less) <= std::abs(more) ? less : more);
    }

    /// Chooses the roll and the rotation of an instance, and goes on with it.
    void enter(std::uint32_t index, RandomKey place)
    {
        Axis& axis = axes_.back();
        axis.begin();
        visits_.push_back({index, place, 0});
        InstanceTransform& transform = archetype_.instances[index].transform;
        if (isDrawn_)
        {
            rises_[index] = courseOf(index, axis.bearing, transform).y;
            return;
        }
        const bool bearsBranches = rollInto(axis, index, place);
        if (!axis.isMoved)
            return;
        if (!bearsBranches)
            standUpright(index, axis.bearing);
        transform.rotation = tidied(rotationThatRises(index, axis.bearing, transform));
    }

    /// Rolls an instance so that its branches stand where they should.
    bool rollInto(Axis& axis, std::uint32_t index, RandomKey place)
    {
        const Whorl whorl = whorlOf(index, axis.bearing);
        if (whorl.sides == 0)
            return false;
        const Azimuths wanted =
            azimuths_.empty() ? Azimuths::AsDrawn : azimuths_[std::min<std::size_t>(axis.order, azimuths_.size() - 1)];
        double azimuth = whorl.azimuth;
        if (wanted == Azimuths::Random)
            azimuth = place.uniform(Purpose::DrawTransform, 0, 360);
        else if (wanted == Azimuths::Phyllotaxis && axis.pieces > 0)
            azimuth = axis.azimuth + kDivergence / whorl.sides;
        else if (wanted == Azimuths::Phyllotaxis && axis.order > 0)
            azimuth = kFirst + kDivergence * axis.number;
        const double roll = azimuth - whorl.azimuth;
        if (InstanceTransform& transform = archetype_.instances[index].transform; wanted != Azimuths::AsDrawn)
        {
            transform.roll = tidied(transform.roll + roll);
            transform.rotation *= math::sinCosDegrees(std::remainder(roll, 360.0)).cos;
            axis.isMoved = axis.isMoved || tidied(roll) != 0;
        }
        axis.azimuth = azimuth;
        ++axis.pieces;
        return true;
    }

    /// Rolls an instance without branches, whose roll nothing else asks for, no more than needed for the plane in which
    /// it turns and bends to be upright.
    void standUpright(std::uint32_t index, const Bearing& start)
    {
        InstanceTransform& transform = archetype_.instances[index].transform;
        const DVec3 climb = across(DVec3(0, 1, 0), start.heading);
        if (glm::length(climb) <= kNothing)
            return;
        Bearing rolled = start;
        rolled.turn(TurtleCommand::RollRight, transform.roll);
        const double roll = azimuthBetween(rolled.left, climb, start.heading);
        // Its left may lead up or down.
        transform.roll = tidied(transform.roll + std::remainder(roll, 180.0));
    }

    /// Walks the instance's own word from where its axis stands.
    [[nodiscard]] Whorl whorlOf(std::uint32_t index, const Bearing& start) const
    {
        const TemplateInstance& instance = archetype_.instances[index];
        std::vector<Bearing> bearings{start};
        std::vector<Leaving> leaving; // not yet told where the axis leads
        std::vector<double> azimuths;
        bool isNew = false; // the bracket has drawn nothing yet
        const auto axisLeads = [&](const DVec3& heading) {
            for (const Leaving& from : leaving)
                for (const DVec3& toward : from.toward)
                    if (const DVec3 aside = across(toward - heading, from.bearing.heading);
                        glm::length(aside) > kNothing)
                        azimuths.push_back(azimuthBetween(from.bearing.reference, aside, from.bearing.heading));
            leaving.clear();
        };
        TurtleFilter filter;
        for (const PlacedModule& module : placed_[instance.piece])
        {
            const bool isAnchor = module.anchor != kNoAnchor;
            if (isAnchor ? childAt(index, module.anchor) == kNoInstance : !filter.carriesOut(module.command))
                continue;
            const std::size_t depth = bearings.size() - 1;
            if (isAnchor || module.command == TurtleCommand::Draw)
            {
                if (depth == 0)
                    axisLeads(bearings[0].heading);
                else if (std::exchange(isNew, false))
                    leaving.back().toward.push_back(bearings.back().heading);
            }
            else if (module.command == TurtleCommand::Push)
            {
                if (depth == 0)
                {
                    leaving.push_back({bearings[0], {}});
                    isNew = true;
                }
                bearings.push_back(bearings.back());
            }
            else if (module.command == TurtleCommand::Pop)
                bearings.pop_back();
            else
                bearings.back().turn(module.command, angleOf(module, instance.transform));
        }
        if (!leaving.empty()) // where the axis ends it would have led on as it came
            axisLeads(DVec3(leaving.back().bearing.heading));
        if (azimuths.empty())
            return {};
        // Sides that are less than a sixth of a turn apart are one.
        std::uint32_t sides = 0;
        for (auto each = azimuths.begin(); each != azimuths.end(); ++each)
            sides += std::none_of(azimuths.begin(), each,
                                  [&](double other) { return std::abs(std::remainder(*each - other, 360.0)) < 60; });
        return {sides, azimuths[0]};
    }

    Archetype& archetype_;
    const AnchorTable anchors_;
    std::span<const Azimuths> azimuths_;
    const std::vector<std::vector<PlacedModule>> placed_; ///< Of each template that occurs.
    std::vector<double> rises_;                           ///< Of each instance as drawn, metres along its axis.
    bool isDrawn_ = false;                                ///< The walk follows what is drawn, to see how much it rises.
    std::vector<Axis> axes_;                              ///< The one that is drawn, and those it left.
    std::vector<Visit> visits_;
    TurtleFilter filter_;
};

} // namespace

Archetype giveDepth(const Archetype& archetype, std::span<const Azimuths> azimuths)
{
    Archetype result = archetype;
    if (azimuths.empty())
        return result;
    DepthGiver giver(result, azimuths);
    for (std::uint32_t tree = 0; tree < anchorsOf(archetype).roots.size(); ++tree)
        giver.give(tree);
    return result;
}

Expected<std::vector<Azimuths>> parseAzimuths(std::string_view text)
{
    std::vector<Azimuths> azimuths;
    for (;;)
    {
        const std::size_t comma = text.find(',');
        const std::string_view name = text.substr(0, comma);
        const auto known = std::find_if(kNames.begin(), kNames.end(), [&](const auto& n) { return n.first == name; });
        if (known == kNames.end())
            return failure(ErrorKind::BadInput, {}, "there are no azimuths \"" + std::string(name.substr(0, 40)) + "\"",
                           "phyllotaxis, random or drawn; for each order one, with commas between");
        azimuths.push_back(known->second);
        if (comma == std::string_view::npos)
            return azimuths;
        text.remove_prefix(comma + 1);
    }
}

std::string printAzimuths(std::span<const Azimuths> azimuths)
{
    std::string text;
    for (const Azimuths each : azimuths)
    {
        text += text.empty() ? "" : ",";
        for (const auto& [name, value] : kNames)
            if (value == each)
                text += name;
    }
    return text;
}

} // namespace espalier
