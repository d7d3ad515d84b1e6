#include "gl/pass_watch.hpp"

#include <unistd.h>

namespace brume {

namespace {

std::atomic<double> limitSeconds = 60;
std::atomic<bool> isRunningOn = false;
thread_local PassLog* logOfThread = nullptr;

}  // namespace

void setPassLimit(double seconds) { limitSeconds = seconds; }
double passLimit() { return limitSeconds; }
bool isAnyPassRunningOn() { return isRunningOn; }

PassLog::Entry PassLog::current() const {
    const std::lock_guard lock(mutex_);
    return entry_;
}

void PassLog::giveUp() { isRunningOn = isGivenUp_ = true; }

void PassWatch::setLog(PassLog* log) { logOfThread = log; }

PassWatch::PassWatch(const std::string& name) {
    if (!logOfThread) return;
    const std::lock_guard lock(logOfThread->mutex_);
    logOfThread->entry_ = {name, logOfThread->entry_.number + 1};
}

PassWatch::~PassWatch() {
    if (!logOfThread) return;
    while (logOfThread->isGivenUp_) pause();
    const std::lock_guard lock(logOfThread->mutex_);
    logOfThread->entry_.name.clear();
}

}  // namespace brume
