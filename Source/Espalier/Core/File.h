#pragma once

#include <Espalier/Core/Error.h>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

namespace espalier {

/// The bytes of a regular file of at most `maxBytes` (ErrorKind::Limit beyond, before reading).
/// Directories, pipes and devices are refused: reading one could block for ever.
[[nodiscard]] Expected<std::string> readFile(const std::filesystem::path& path, std::size_t maxBytes);

/// readFile for text: refuses invalid UTF-8 with its line and column, and drops a leading byte order mark.
[[nodiscard]] Expected<std::string> readTextFile(const std::filesystem::path& path, std::size_t maxBytes);

/// Replaces the file at `path` by `bytes` or leaves it as it was: writes a temporary file in the same folder, flushes
/// it to disk, then renames. The folder must exist. Afterwards a reader finds the old or the new file, never a torn
/// one. An old file keeps its permissions, and a read-only one is refused. A symbolic link is followed.
[[nodiscard]] Expected<void> writeFileAtomically(const std::filesystem::path& path, std::string_view bytes);

/// Takes the next bytes of something that is written from front to end. After a failure nothing more may be given.
using ByteSink = std::function<Expected<void>(std::string_view bytes)>;

/// writeFileAtomically for bytes that nobody wants in memory as a whole: `produce` hands them to the sink, in runs that
/// should be long, for each is a call of the system. What `produce` fails with is passed on, and the old file stays.
[[nodiscard]] Expected<void> writeFileAtomically(const std::filesystem::path& path,
                                                 const std::function<Expected<void>(const ByteSink&)>& produce);

} // namespace espalier
