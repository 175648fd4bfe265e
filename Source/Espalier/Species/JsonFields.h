#pragma once

#include <Espalier/Core/Json.h>
#include <array>
#include <charconv>
#include <string>

namespace espalier {

/// Reads optional keys of an object into fields; remembers the first error and does nothing after it.
class Fields
{
public:
    using Value = JsonDocument::Value;

    explicit Fields(const Value& object) : object_(object) {}

    Fields& number(std::string_view key, auto& field, double low, double high)
    {
        return read(key, [&](const Value& value) {
            return value.number(key, low, high).map([&](double v) {
                field = static_cast<std::remove_reference_t<decltype(field)>>(v);
            });
        });
    }
    Fields& count(std::string_view key, std::uint32_t& field, std::uint32_t low, std::uint32_t high)
    {
        return read(key, [&](const Value& value) {
            return value.count(key, low, high).map([&](std::uint64_t v) { field = static_cast<std::uint32_t>(v); });
        });
    }
    Fields& string(std::string_view key, std::string& field)
    {
        return read(key,
                    [&](const Value& value) { return value.string(key).map([&](std::string_view v) { field = v; }); });
    }
    /// Any other shape: `reader(value)` returns Expected<void>.
    template <class Reader>
    Fields& read(std::string_view key, Reader&& reader)
    {
        if (const Value value = object_[key]; result_ && value.exists())
            result_ = reader(value);
        return *this;
    }
    [[nodiscard]] Expected<void> result() const { return result_; }

private:
    Value object_;
    Expected<void> result_;
};

/// What reads back as this float, so that 0.2f is written 0.2.
inline std::string shortest(float value)
{
    std::array<char, 32> buffer;
    return std::string(buffer.data(), std::to_chars(buffer.data(), buffer.data() + buffer.size(), value).ptr);
}

} // namespace espalier
