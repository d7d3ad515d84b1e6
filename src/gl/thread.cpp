#include <condition_variable>
#include <deque>
#include <mutex>
#include <thread>

#include "error.hpp"
#include "gl/context.hpp"
#include "gl/pass_watch.hpp"

namespace brume {

struct GlThread::State {
    std::mutex mutex;
    std::condition_variable wake;
    std::deque<std::packaged_task<void(GlContext&)>> jobs;
    bool stopping = false;
    std::thread thread;
    PassLog log;
    std::string verdict;  // where given up, why

    void work(const std::function<std::unique_ptr<GlContext>()>& make, std::promise<void>& made) {
        std::unique_ptr<GlContext> context;
        PassWatch::setLog(&log);
        try {
            context = make();
        } catch (...) {
            made.set_exception(std::current_exception());
            return;
        }
        made.set_value();
        for (;;) {
            std::unique_lock lock(mutex);
            wake.wait(lock, [&] { return stopping || !jobs.empty(); });
            if (jobs.empty()) return;
            auto job = std::move(jobs.front());
            jobs.pop_front();
            lock.unlock();
            job(*context);
        }
    }
};

GlThread::GlThread(GlPlatform platform) : GlThread([platform] { return GlContext::create(platform); }) {}

GlThread::GlThread(std::function<std::unique_ptr<GlContext>()> make) : state_(std::make_shared<State>()) {
    std::promise<void> made;
    auto future = made.get_future();
    state_->thread = std::thread([state = state_, &make, &made] { state->work(make, made); });
    try {
        future.get();
    } catch (...) {
        state_->thread.join();
        throw;
    }
}

GlThread::~GlThread() {
    {
        std::lock_guard lock(state_->mutex);
        state_->stopping = true;
        if (!state_->verdict.empty()) return;
    }
    state_->wake.notify_one();
    state_->thread.join();
}

void GlThread::run(const std::function<void(GlContext&)>& job) {
    std::packaged_task<void(GlContext&)> task(job);
    auto done = task.get_future();
    {
        std::lock_guard lock(state_->mutex);
        if (!state_->verdict.empty()) failUsage(state_->verdict);
        state_->jobs.push_back(std::move(task));
    }
    state_->wake.notify_one();
    // Counted in waits, not by the clock, which runs on while the whole program is stopped.
    constexpr std::chrono::milliseconds once(250);
    PassLog::Entry pass;
    for (double waited = 0; done.wait_for(once) != std::future_status::ready; waited += .25) {
        const PassLog::Entry now = state_->log.current();
        if (now.number != pass.number || now.name.empty()) waited = 0;
        pass = now;
        if (waited >= passLimit()) giveUp(pass.name);
    }
    done.get();
}

void GlThread::giveUp(const std::string& pass) {
    std::lock_guard lock(state_->mutex);
    if (state_->verdict.empty()) {
        state_->verdict = text(pass, ": did not finish within ", passLimit(),
                               " s; its shader may never end (--pass-seconds raises the limit)");
        state_->log.giveUp();
        state_->thread.detach();
    }
    failUsage(state_->verdict);
}

bool GlThread::isGivenUp() const {
    std::lock_guard lock(state_->mutex);
    return !state_->verdict.empty();
}

std::string GlThread::describe() {
    std::string described;
    run([&](GlContext& context) { described = context.describe(); });
    return described;
}

}  // namespace brume
