#include <Espalier/Bake/Swc.h>

#include <Espalier/Core/File.h>
#include <Espalier/Core/Json.h>
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <map>

namespace espalier {

namespace {

constexpr int kSoma = 1;
constexpr double kLargestId = 9007199254740992.0; ///< Up to here a double tells whole numbers apart.

bool isBlank(char c)
{
    return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f';
}

/// Bytes of a file as a message can show them, whatever their encoding.
std::string shown(std::string_view token)
{
    std::string text;
    for (const char c : token.substr(0, 40))
        text += c > ' ' && c <= '~' ? c : '?';
    return text;
}

/// One file; positions are byte offsets, turned into line and column only for errors.
class SwcParser
{
public:
    SwcParser(std::string_view text, std::string_view file, const Limits& limits)
        : text_(text), file_(file), limits_(limits)
    {}

    Expected<PointTree> parse()
    {
        for (std::size_t start = 0; start < text_.size();)
        {
            const std::size_t end = std::min(text_.find('\n', start), text_.size());
            const std::size_t length = std::min(text_.substr(start, end - start).find('#'), end - start);
            if (auto done = line(start, start + length); !done)
                return tl::make_unexpected(done.error());
            start = end + 1;
        }
        if (points_.empty())
            return fail(0, "the file holds no point", "lines of seven numbers: id type x y z radius parent");
        if (auto done = link(); !done)
            return tl::make_unexpected(done.error());
        leaveOutSomaEnds();
        return std::move(tree_);
    }

private:
    enum Column : std::size_t
    {
        Id,
        Type,
        X,
        Y,
        Z,
        Radius,
        Parent,
        kColumns,
    };

    struct Point
    {
        std::size_t line = 0; ///< Byte offsets.
        std::size_t parentAt = 0;
        double id = 0;
        double parent = 0;
        bool isSoma = false;
    };

    tl::unexpected<Error> fail(std::size_t offset, std::string what, std::string expected,
                               ErrorKind kind = ErrorKind::BadInput) const
    {
        return failure(kind, locate(file_, text_, offset), std::move(what), std::move(expected));
    }

    Expected<void> line(std::size_t at, std::size_t end)
    {
        std::array<double, kColumns> values{};
        std::array<std::size_t, kColumns> places{};
        std::size_t column = 0;
        for (; column < kColumns; ++column)
        {
            while (at < end && isBlank(text_[at]))
                ++at;
            if (at == end)
                break;
            const std::size_t start = at;
            while (at < end && !isBlank(text_[at]))
                ++at;
            places[column] = start;
            if (auto done = number(column, start, text_.substr(start, at - start), values[column]); !done)
                return done;
        }
        if (column == 0)
            return {};
        if (column < kColumns)
            return fail(end, "the line ends after " + std::to_string(column) + (column == 1 ? " number" : " numbers"),
                        "seven: id type x y z radius parent");
        if (points_.size() >= limits_.nodes)
            return fail(places[Id], "more than " + std::to_string(limits_.nodes) + " points", "at most the limit nodes",
                        ErrorKind::Limit);
        points_.push_back({places[Id], places[Parent], values[Id], values[Parent], values[Type] == kSoma});
        tree_.positions.push_back({values[X], values[Y], values[Z]});
        tree_.radii.push_back(values[Radius]);
        tree_.isBody.push_back(values[Type] == kSoma);
        return {};
    }

    Expected<void> number(std::size_t column, std::size_t at, std::string_view token, double& value) const
    {
        constexpr std::array<std::string_view, kColumns> kNames = {"id", "type", "x", "y", "z", "radius", "parent"};
        const std::string name(kNames[column]);
        const std::size_t sign = token.starts_with('+') ? 1 : 0;
        const char* const end = token.data() + token.size();
        const auto read = std::from_chars(token.data() + sign, end, value);
        if (read.ec == std::errc::result_out_of_range && read.ptr == end)
            return fail(at, "the " + name + ' ' + shown(token) + " is too large or too small for a number",
                        "a number such as 12.5");
        if (read.ec != std::errc{} || read.ptr != end || (sign == 1 && token.starts_with("+-")))
            return fail(at, '`' + shown(token) + "` is no number", "the " + name + ", a number such as 12.5");
        if (!std::isfinite(value))
            return fail(at, "the " + name + " is " + shown(token), "a finite number");
        const bool isWhole = column == Id || column == Type || column == Parent;
        if (isWhole && (value != std::floor(value) || std::abs(value) > kLargestId))
            return fail(at, "the " + name + " is " + shown(token), "a whole number up to 2^53");
        if (column == Radius && value < 0)
            return fail(at, "the radius is " + shown(token), "a number of 0 or more");
        if (column == Id && value < 0)
            return fail(at, "the id is " + shown(token), "a number of 0 or more; -1 means no parent");
        return {};
    }

    /// Turns ids into indices.
    Expected<void> link()
    {
        std::vector<std::uint32_t> byId(points_.size());
        for (std::uint32_t i = 0; i < byId.size(); ++i)
            byId[i] = i;
        const auto idOf = [&](std::uint32_t i) { return points_[i].id; };
        std::ranges::stable_sort(byId, {}, idOf);
        for (std::size_t i = 1; i < byId.size(); ++i)
            if (idOf(byId[i]) == idOf(byId[i - 1]))
                return fail(points_[byId[i]].line,
                            "the id " + formatNumber(idOf(byId[i])) + " is taken by line " +
                                std::to_string(locate(file_, text_, points_[byId[i - 1]].line).line),
                            "an id of its own for each point");
        tree_.parents.assign(points_.size(), kNoPoint);
        for (std::uint32_t i = 0; i < points_.size(); ++i)
        {
            const Point& point = points_[i];
            if (point.parent == -1)
                continue;
            const auto found = std::ranges::lower_bound(byId, point.parent, {}, idOf);
            if (found == byId.end() || idOf(*found) != point.parent)
                return fail(point.parentAt, "there is no point " + formatNumber(point.parent),
                            "the id of a point of this file, or -1 for a root");
            tree_.parents[i] = *found;
        }
        if (const auto cycle = findCycle(tree_))
            return fail(points_[*cycle].parentAt,
                        "the point " + formatNumber(points_[*cycle].id) + " hangs on itself, through its parents",
                        "parents that lead to a root, whose parent is -1");
        return {};
    }

    /// A soma of three points: the middle, and two ends that make no branch.
    void leaveOutSomaEnds()
    {
        std::vector<std::uint32_t> children(points_.size(), 0);
        for (const std::uint32_t parent : tree_.parents)
            if (parent != kNoPoint)
                ++children[parent];
        std::map<std::uint32_t, std::vector<std::uint32_t>> ends; ///< Of each soma.
        for (std::uint32_t i = 0; i < points_.size(); ++i)
        {
            const std::uint32_t parent = tree_.parents[i];
            if (parent != kNoPoint && tree_.parents[parent] == kNoPoint && tree_.isBody[i] && tree_.isBody[parent] &&
                children[i] == 0)
                ends[parent].push_back(i);
        }
        for (const auto& [soma, both] : ends)
            for (const std::uint32_t end : both)
                if (both.size() == 2)
                    tree_.positions[end] = tree_.positions[soma]; // which makes no segment
    }

    std::string_view text_;
    std::string_view file_;
    const Limits& limits_;
    std::vector<Point> points_;
    PointTree tree_;
};

/// Nine digits tell all floats apart.
void appendFloat(std::string& text, float value)
{
    std::array<char, 32> digits{};
    const auto written =
        std::to_chars(digits.data(), digits.data() + digits.size(), value, std::chars_format::general, 9);
    text.append(digits.data(), written.ptr);
}

class SwcPrinter
{
public:
    std::string print(const Skeleton& skeleton, std::string_view comment)
    {
        head(comment);
        std::vector<std::uint32_t> pointOf(skeleton.size()); // that ends each segment
        // Branches of one place share their root, if no other stands between them: so the order stays.
        struct Root
        {
            std::uint32_t point = 0;
            Vec3 position{0};
            float radius = 0;
        } root;
        for (std::uint32_t i = 0; i < skeleton.size(); ++i)
        {
            const Vec3& start = skeleton.starts[i];
            const float radius = skeleton.startRadii[i];
            const std::uint32_t parent = skeleton.parents[i];
            std::uint32_t from = 0;
            Vec3 there = start;
            float thereRadius = radius;
            if (parent != kNoSegment)
            {
                from = pointOf[parent];
                there = skeleton.ends[parent];
                thereRadius = skeleton.endRadii[parent];
            }
            else
            {
                if (root.point == 0 || root.position != start)
                    root = {point(start, radius, 0), start, radius};
                from = root.point;
                thereRadius = root.radius;
            }
            if (start != there || radius != thereRadius)
                from = point(start, radius, from);
            pointOf[i] = point(skeleton.ends[i], skeleton.endRadii[i], from);
        }
        return std::move(text_);
    }

private:
    void head(std::string_view comment)
    {
        while (!comment.empty())
        {
            const std::size_t end = std::min(comment.find('\n'), comment.size());
            text_ += "# " + std::string(comment.substr(0, end)) + '\n';
            comment.remove_prefix(std::min(end + 1, comment.size()));
        }
        text_ += "# metres, Y up: id type x y z radius parent\n";
    }

    /// `parent` 0: none.
    std::uint32_t point(const Vec3& position, float radius, std::uint32_t parent)
    {
        text_ += std::to_string(++last_) + " 0";
        for (const float value : {position.x, position.y, position.z, radius})
        {
            text_ += ' ';
            appendFloat(text_, value);
        }
        text_ += ' ' + (parent == 0 ? "-1" : std::to_string(parent)) + '\n';
        return last_;
    }

    std::string text_;
    std::uint32_t last_ = 0; ///< Id of the point written last.
};

} // namespace

Expected<ImportedSkeleton> parseSwc(std::string_view text, std::string_view file, const ImportSettings& settings,
                                    const Limits& limits)
{
    if (text.size() > limits.fileBytes)
        return failure(ErrorKind::Limit, {std::string(file), 0, 0},
                       "the text has " + std::to_string(text.size()) + " bytes",
                       "at most " + std::to_string(limits.fileBytes) + " (the limit fileBytes)");
    const auto tree = SwcParser(text, file, limits).parse();
    if (!tree)
        return tl::make_unexpected(tree.error());
    return skeletonOf(*tree, settings, file, limits);
}

Expected<ImportedSkeleton> loadSwc(const std::filesystem::path& path, const ImportSettings& settings,
                                   const Limits& limits)
{
    // Bytes, not UTF-8: comments of archives are in any encoding.
    const auto text = readFile(path, limits.fileBytes);
    if (!text)
        return tl::make_unexpected(text.error());
    constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";
    std::string_view all = *text;
    if (all.starts_with(kByteOrderMark))
        all.remove_prefix(kByteOrderMark.size());
    return parseSwc(all, path.string(), settings, limits);
}

std::string printSwc(const Skeleton& skeleton, std::string_view comment)
{
    return SwcPrinter().print(skeleton, comment);
}

Expected<void> saveSwc(const std::filesystem::path& path, const Skeleton& skeleton, std::string_view comment)
{
    return writeFileAtomically(path, printSwc(skeleton, comment));
}

} // namespace espalier
