#include "frame/pending_file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "error.hpp"

namespace brume {

namespace fs = std::filesystem;

PendingFile::PendingFile(const std::string& target) : target_(target) {
    static std::atomic<int> counter{0};
    const fs::path path(target);
    const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
    std::error_code error;
    if (!fs::is_directory(folder, error)) failIo(target, ": the folder ", folder.string(), " does not exist");
    if (fs::is_directory(path, error)) failIo(target, ": is a folder");
    if (fs::exists(path, error) && !fs::is_regular_file(path, error))
        failIo(target, ": is a device or a pipe, which a file would replace");
    // A name as long as the disk allows is to leave room for the number.
    path_ = (folder / ("." + path.stem().string().substr(0, 64) + "." + std::to_string(getpid()) + "-" +
                       std::to_string(counter++) + path.extension().string()))
                .string();
    const int file = open(path_.c_str(), O_WRONLY | O_CREAT | O_EXCL, 0666);
    if (file < 0) failIo(target, ": cannot be written: ", std::strerror(errno));
    close(file);
}

PendingFile::~PendingFile() {
    if (!committed_) unlink(path_.c_str());
}

void PendingFile::commit() {
    const int file = open(path_.c_str(), O_RDONLY);
    const bool onDisk = file >= 0 && fsync(file) == 0;
    const int reason = errno;
    if (file >= 0) close(file);
    if (!onDisk) failIo(target_, ": cannot be written: ", std::strerror(reason));
    if (std::rename(path_.c_str(), target_.c_str()) != 0)
        failIo(target_, ": cannot be written: ", std::strerror(errno));
    committed_ = true;
}

void writeWhole(const std::string& target, const std::string& content) {
    PendingFile pending(target);
    std::ofstream out(pending.path(), std::ios::binary);
    out << content;
    out.close();
    if (!out) failIo(target, ": cannot be written: ", std::strerror(errno));
    pending.commit();
}

GrowingFile::GrowingFile(const std::string& target, const std::string& beginning) : target_(target) {
    writeWhole(target, beginning);
    file_ = open(target.c_str(), O_WRONLY | O_APPEND | O_NOFOLLOW);
    if (file_ < 0) failIo(target, ": cannot be written: ", std::strerror(errno));
}

GrowingFile::~GrowingFile() { close(file_); }

void GrowingFile::append(const std::string& piece) {
    for (size_t done = 0; done < piece.size();) {
        const ssize_t count = write(file_, piece.data() + done, piece.size() - done);
        if (count < 0) failIo(target_, ": cannot be written: ", std::strerror(errno));
        done += size_t(count);
    }
}

}  // namespace brume
