// brume's end of the line: starts reader processes, hands them files, and tells what became of them.
#include "frame/reader_process.hpp"

#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>

#include <filesystem>
#include <mutex>

#include "error.hpp"
#include "frame/image_file.hpp"
#include "frame/reader_line.hpp"
#include "frame/shared_image.hpp"
#include "install_root.hpp"

extern char** environ;

namespace brume {

using nlohmann::json;

namespace {

constexpr int lineInReader = 3;

/// One running brume_reader; ends it when it goes.
class ReaderProcess {
  public:
    ReaderProcess() {
        const std::string program = installRoot() + "/brume_reader";
        int lines[2];
        if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, lines) != 0)
            failIo("brume's reader cannot be started: ", std::strerror(errno));
        line_ = lines[0];
        const timeval patience{60, 0};  // between the parts of an answer that has begun
        setsockopt(line_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
        posix_spawn_file_actions_t actions;
        posix_spawn_file_actions_init(&actions);
        posix_spawn_file_actions_adddup2(&actions, lines[1], lineInReader);
        posix_spawnattr_t attributes;
        posix_spawnattr_init(&attributes);
        // A group of its own: Ctrl-C is for brume, which finishes what it has begun.
        posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
        std::string name = "brume_reader";
        char* arguments[] = {name.data(), nullptr};
        const int failed = posix_spawn(&process_, program.c_str(), &actions, &attributes, arguments, environ);
        posix_spawnattr_destroy(&attributes);
        posix_spawn_file_actions_destroy(&actions);
        close(lines[1]);
        if (failed) {
            close(line_);
            failIo(program, ": brume's reader cannot be started: ", std::strerror(failed),
                   "; reinstall brume");
        }
    }
    ~ReaderProcess() {
        if (!ended_) end();
        close(line_);
    }
    ReaderProcess(const ReaderProcess&) = delete;
    ReaderProcess& operator=(const ReaderProcess&) = delete;

    /// False where the process ended or was ended instead.
    bool ask(const Message& question, Message& answer, double seconds) {
        if (!sendMessage(line_, question)) return false;
        // The reader's own limit is of processor time, which a busy machine does not use up; this one is for
        // a reader that waits for ever. A stop of the whole program counts as one second.
        pollfd ready{line_, POLLIN, 0};
        for (double waited = 0; waited < 20 * seconds; ++waited)
            if (poll(&ready, 1, 1000) > 0) return receiveMessage(line_, answer);
        isStuck_ = true;
        return false;
    }

    bool isRunning() {
        if (!ended_ && waitpid(process_, nullptr, WNOHANG) != 0) ended_ = true;
        return !ended_;
    }
    AdoptedImages& images() { return images_; }

    /// Why the process is no more.
    std::string end() {
        int status = 0;
        bool isGone = false;
        ended_ = true;
        shutdown(line_, SHUT_RDWR);  // a sound reader ends at that
        for (int k = 0; !isStuck_ && !isGone; ++k) {
            isGone = waitpid(process_, &status, WNOHANG) != 0;
            if (!isGone) usleep(1000);
            isStuck_ = k >= 5000;
        }
        if (!isGone) {
            kill(process_, SIGKILL);
            while (waitpid(process_, &status, 0) < 0 && errno == EINTR) {
            }
        }
        if (isStuck_ || (WIFSIGNALED(status) && WTERMSIG(status) == SIGXCPU)) return "took too long";
        if (WIFSIGNALED(status)) return text("crashed (", strsignal(WTERMSIG(status)), ")");
        return text("ended with status ", WEXITSTATUS(status));
    }

  private:
    pid_t process_ = -1;
    int line_ = -1;
    bool isStuck_ = false, ended_ = false;
    AdoptedImages images_;
};

/// Readers that wait for work.
class Pool {
  public:
    std::unique_ptr<ReaderProcess> take() {
        {
            const std::lock_guard lock(mutex_);
            while (!idle_.empty()) {
                auto reader = std::move(idle_.back());
                idle_.pop_back();
                if (reader->isRunning()) return reader;
            }
        }
        return std::make_unique<ReaderProcess>();
    }
    void giveBack(std::unique_ptr<ReaderProcess> reader) {
        const std::lock_guard lock(mutex_);
        idle_.push_back(std::move(reader));
    }

  private:
    std::mutex mutex_;
    std::vector<std::unique_ptr<ReaderProcess>> idle_;
};

Pool& pool() {
    static Pool readers;
    return readers;
}

double secondsFor(const DecodeRequest& request) {
    if (request.seconds) return *request.seconds;
    std::error_code none;
    const uintmax_t bytes = std::filesystem::file_size(request.path, none);
    return raisedBy(request.maxPixels) * (30 + (none ? 0 : double(bytes) / (1 << 20)));
}

/// Descriptors that nobody has taken over yet.
class Files {
  public:
    explicit Files(std::vector<int> files) : files_(std::move(files)) {}
    ~Files() {
        for (; next_ < files_.size(); ++next_) close(files_[next_]);
    }
    Files(const Files&) = delete;
    Files& operator=(const Files&) = delete;
    int take() {
        if (next_ == files_.size()) failIo("the reader's process handed over an image that is not there");
        return files_[next_++];
    }

  private:
    std::vector<int> files_;
    size_t next_ = 0;
};

Decoded unpack(const Message& answer, AdoptedImages& images) {
    Files files(answer.files);
    const json reply = json::from_cbor(answer.bytes);
    if (reply.contains("error"))
        throw Error(reply.at("kind") == ErrorKind::Usage ? ErrorKind::Usage : ErrorKind::Io,
                    reply.at("error").get<std::string>());
    Decoded decoded;
    decoded.facts = reply.at("facts");
    for (const json& image : reply.at("images"))
        decoded.images.push_back(images.adopt(image.at(3), image.at(4).get<bool>() ? files.take() : -1,
                                              {image.at(0), image.at(1)}, image.at(2)));
    for (const int buffer : reply.at("given up")) images.forget(buffer);
    return decoded;
}

}  // namespace

Decoded decodeApart(const DecodeRequest& request) {
    const double seconds = secondsFor(request);
    auto reader = pool().take();
    Message question, answer;
    question.bytes = json::to_cbor(json{{"what", int(request.what)},
                                        {"path", request.path},
                                        {"maxPixels", request.maxPixels},
                                        {"wantDepth", request.wantDepth},
                                        {"seconds", seconds},
                                        {"memory", request.memory.value_or(0)},
                                        {"released", reader->images().released()}});
    if (!reader->ask(question, answer, seconds))
        failIo(request.path, ": is damaged: decoding it ", reader->end(),
               ", in a process apart, so nothing else is lost");
    try {
        Decoded decoded = unpack(answer, reader->images());
        pool().giveBack(std::move(reader));
        return decoded;
    } catch (const json::exception&) {
        failIo(request.path, ": is damaged: the process that decoded it answers nonsense");
    } catch (const Error&) {
        pool().giveBack(std::move(reader));
        throw;
    }
}

}  // namespace brume
