#include "folder_lock.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <regex>

#include "error.hpp"

namespace brume::host {
namespace {

namespace fs = std::filesystem;

// As frame/pending_file names them: ".NAME.PID-N.EXT".
void sweepUp(const std::string& folder) {
    static const std::regex pending(R"(\..+\.([0-9]{1,9})-[0-9]+\.[a-z]+)");
    std::error_code none;
    for (const auto& entry : fs::directory_iterator(folder, none)) {
        std::smatch match;
        std::string name = entry.path().filename().string();
        if (!std::regex_match(name, match, pending)) continue;
        bool isAlive = kill(pid_t(std::stol(match[1].str())), 0) == 0 || errno != ESRCH;
        if (!isAlive) fs::remove(entry.path(), none);
    }
}

}  // namespace

FolderLock::FolderLock(const std::string& folder, bool isShard) {
    std::error_code error;
    fs::create_directories(folder, error);
    file_ = error ? -1 : open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (file_ < 0)
        failIo("'", folder, "' cannot be used for output: ", error ? error.message() : std::strerror(errno));
    if (flock(file_, (isShard ? LOCK_SH : LOCK_EX) | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
        close(file_);
        failIo("another brume is writing into '", folder, "'; wait for it, or write elsewhere");
    }
    if (!isShard) sweepUp(folder);
}

FolderLock::~FolderLock() { close(file_); }

}  // namespace brume::host
