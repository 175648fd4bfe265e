#include <Espalier/Core/File.h>

#include <Espalier/Core/Utf8.h>
#include <algorithm>
#include <atomic>
#include <cerrno>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

namespace espalier {

namespace fs = std::filesystem;

namespace {

std::string reason(int code)
{
    return std::generic_category().message(code); // strerror is not thread-safe.
}

Location wholeFile(const fs::path& path)
{
    return {path.string(), 0, 0};
}

// The only code that talks to the operating system. Functions return 0 or errno.
class Descriptor
{
public:
    Descriptor() = default;
    Descriptor(const Descriptor&) = delete;
    Descriptor& operator=(const Descriptor&) = delete;
    ~Descriptor() { static_cast<void>(close()); }

    [[nodiscard]] int open(const fs::path& path, int flags, mode_t mode = 0)
    {
        do
            fd_ = ::open(path.c_str(), flags | O_CLOEXEC, mode);
        while (fd_ < 0 && errno == EINTR);
        return fd_ < 0 ? errno : 0;
    }
    [[nodiscard]] int status(struct stat& result) const { return ::fstat(fd_, &result) == 0 ? 0 : errno; }
    [[nodiscard]] int setMode(mode_t mode) const { return ::fchmod(fd_, mode) == 0 ? 0 : errno; }
    [[nodiscard]] int flush() const { return ::fsync(fd_) == 0 ? 0 : errno; }

    /// Reads at most `size` bytes; `got` is 0 at the end of the file.
    [[nodiscard]] int read(char* buffer, std::size_t size, std::size_t& got) const
    {
        ssize_t result = 0;
        do
            result = ::read(fd_, buffer, size);
        while (result < 0 && errno == EINTR);
        got = result < 0 ? 0 : static_cast<std::size_t>(result);
        return result < 0 ? errno : 0;
    }

    [[nodiscard]] int writeAll(std::string_view bytes) const
    {
        while (!bytes.empty())
        {
            const ssize_t written = ::write(fd_, bytes.data(), bytes.size());
            if (written < 0 && errno != EINTR)
                return errno;
            if (written > 0)
                bytes.remove_prefix(static_cast<std::size_t>(written));
        }
        return 0;
    }

    [[nodiscard]] int close()
    {
        const int fd = std::exchange(fd_, -1);
        return fd < 0 || ::close(fd) == 0 || errno == EINTR ? 0 : errno;
    }

private:
    int fd_ = -1;
};

tl::unexpected<Error> notARegularFile(const fs::path& path, mode_t mode)
{
    return failure(ErrorKind::Io, wholeFile(path),
                   S_ISDIR(mode) ? "this is a folder" : "this is a pipe, socket or device", "a regular file");
}

tl::unexpected<Error> tooLarge(const fs::path& path, const std::string& size, std::size_t maxBytes)
{
    return failure(ErrorKind::Limit, {path.string(), 1, 1}, "the file has " + size + " bytes",
                   "at most " + std::to_string(maxBytes) + " (limit fileBytes)");
}

// A new file beside the one that it will replace; it vanishes with this object unless it was published.
class TemporaryFile
{
public:
    TemporaryFile() = default;
    TemporaryFile(const TemporaryFile&) = delete;
    TemporaryFile& operator=(const TemporaryFile&) = delete;
    ~TemporaryFile()
    {
        if (!path_.empty())
            ::unlink(path_.c_str());
    }

    [[nodiscard]] int create(const fs::path& folder)
    {
        static std::atomic<unsigned> counter = 0;
        for (;;)
        {
            // Short, so that it fits wherever the target's name fits. A killed process may have left one behind.
            fs::path path = folder / (".espalier-" + std::to_string(::getpid()) + '-' + std::to_string(counter++));
            const int code = descriptor_.open(path, O_WRONLY | O_CREAT | O_EXCL, 0666);
            if (code == EEXIST)
                continue;
            if (code == 0)
                path_ = std::move(path);
            return code;
        }
    }

    [[nodiscard]] int publishAs(const fs::path& target)
    {
        if (::rename(path_.c_str(), target.c_str()) != 0)
            return errno;
        path_.clear();
        return 0;
    }

    [[nodiscard]] Descriptor& descriptor() { return descriptor_; }

private:
    fs::path path_;
    Descriptor descriptor_;
};

} // namespace

Expected<std::string> readFile(const fs::path& path, std::size_t maxBytes)
{
    const auto failed = [&](int code) {
        return failure(ErrorKind::Io, wholeFile(path), "the file cannot be read: " + reason(code));
    };

    Descriptor file;
    if (const int code = file.open(path, O_RDONLY | O_NONBLOCK); code != 0) // Without it, opening a pipe would block.
        return failed(code);
    struct stat status = {};
    if (const int code = file.status(status); code != 0)
        return failed(code);
    if (!S_ISREG(status.st_mode))
        return notARegularFile(path, status.st_mode);
    const auto size = static_cast<std::uint64_t>(status.st_size);
    if (size > maxBytes)
        return tooLarge(path, std::to_string(size), maxBytes);

    // One byte more than the size, to see the end, and to notice a file that grows meanwhile.
    std::string bytes(static_cast<std::size_t>(size) + 1, '\0');
    std::size_t used = 0;
    for (;;)
    {
        std::size_t got = 0;
        if (const int code = file.read(bytes.data() + used, bytes.size() - used, got); code != 0)
            return failed(code);
        if (got == 0)
            break;
        used += got;
        if (used > maxBytes)
            return tooLarge(path, "more than " + std::to_string(maxBytes), maxBytes);
        if (used == bytes.size())
            bytes.resize(std::min(2 * used, maxBytes) + 1);
    }
    bytes.resize(used);
    return bytes;
}

Expected<std::string> readTextFile(const fs::path& path, std::size_t maxBytes)
{
    Expected<std::string> text = readFile(path, maxBytes);
    if (!text)
        return text;
    if (text->starts_with("\xef\xbb\xbf"))
        text->erase(0, 3);
    if (const std::size_t offset = findInvalidUtf8(*text); offset != std::string::npos)
    {
        constexpr char kDigits[] = "0123456789abcdef";
        const auto byte = static_cast<unsigned char>((*text)[offset]);
        return failure(ErrorKind::BadInput, locate(path.string(), *text, offset),
                       std::string("the byte 0x") + kDigits[byte >> 4] + kDigits[byte & 15] + " is not valid here",
                       "UTF-8 text", "save the file as UTF-8");
    }
    return text;
}

Expected<void> writeFileAtomically(const fs::path& path, std::string_view bytes)
{
    return writeFileAtomically(path, [&](const ByteSink& sink) { return sink(bytes); });
}

Expected<void> writeFileAtomically(const fs::path& path, const std::function<Expected<void>(const ByteSink&)>& produce)
{
    struct stat old = {};
    const bool exists = ::stat(path.c_str(), &old) == 0;
    const auto failed = [&](int code) {
        return failure(ErrorKind::Io, wholeFile(path), "the file cannot be written: " + reason(code), {},
                       exists ? "the old file is intact" : "no file was made");
    };
    if (!exists && errno != ENOENT)
        return failed(errno);
    if (exists && !S_ISREG(old.st_mode))
        return notARegularFile(path, old.st_mode);
    if (exists && ::access(path.c_str(), W_OK) != 0)
        return failed(errno); // The folder would let us replace a read-only file; its owner would not.

    // Through a symbolic link to the file that it names, as any other program would write.
    fs::path target = path;
    if (std::error_code code; fs::is_symlink(path, code))
    {
        target = fs::canonical(path, code);
        if (code)
            return failed(code.value());
    }
    const fs::path folder = target.has_parent_path() ? target.parent_path() : fs::path(".");

    if (std::error_code code; !fs::is_directory(folder, code))
        return failure(ErrorKind::Io, wholeFile(path), "the folder " + folder.string() + " does not exist", {},
                       "make the folder first");

    TemporaryFile temporary;
    Descriptor& file = temporary.descriptor();
    int code = temporary.create(folder);
    if (code == 0 && exists)
        code = file.setMode(old.st_mode & 0777);
    if (code != 0)
        return failed(code);
    const ByteSink sink = [&](std::string_view bytes) -> Expected<void> {
        if (const int writing = file.writeAll(bytes); writing != 0)
            return failed(writing);
        return {};
    };
    if (auto produced = produce(sink); !produced)
        return produced;
    code = file.flush();
    if (code == 0)
        code = file.close();
    if (code == 0)
        code = temporary.publishAs(target);
    if (code != 0)
        return failed(code);

    // Makes the rename itself survive a power cut. Not every file system can; the file is whole either way.
    Descriptor directory;
    if (directory.open(folder, O_RDONLY | O_DIRECTORY) == 0)
        static_cast<void>(directory.flush());
    return {};
}

} // namespace espalier
