// What the thread of a GL context is busy with, so that whoever waits for it can give up and say why: a
// shader may run for ever, and nothing can stop it.
#pragma once

#include <atomic>
#include <cstdint>
#include <mutex>
#include <string>

namespace brume {

/// How long one pass of an effect may take, compiling included; then GlThread::run throws Error (Usage)
/// naming it. Of this process, 60 s unless set. Safe from any thread.
void setPassLimit(double seconds);
double passLimit();

/// True once a GlThread was given up: its pass may run on, so the process should end by _exit.
bool isAnyPassRunningOn();

/// Shared by a GlThread and those who wait for it.
class PassLog {
  public:
    struct Entry {
        std::string name;
        uint64_t number = 0;  ///< of the pass; grows
    };
    Entry current() const;
    /// The thread will never come back: it stops where it next looks.
    void giveUp();

  private:
    friend class PassWatch;
    mutable std::mutex mutex_;
    Entry entry_;
    std::atomic<bool> isGivenUp_ = false;
};

/// While it lives, this thread, if a GlThread's, works on that pass. Its end never returns where the thread
/// was given up: what the waiting side lent is no longer there.
class PassWatch {
  public:
    explicit PassWatch(const std::string& name);
    ~PassWatch();
    PassWatch(const PassWatch&) = delete;
    PassWatch& operator=(const PassWatch&) = delete;

    /// By GlThread, once: whose log this thread writes.
    static void setLog(PassLog* log);
};

}  // namespace brume
