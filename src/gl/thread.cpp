#include <condition_variable>
#include <deque>
#include <mutex>
#include <thread>

#include "gl/context.hpp"

namespace brume {

struct GlThread::State {
    std::mutex mutex;
    std::condition_variable wake;
    std::deque<std::packaged_task<void(GlContext&)>> jobs;
    bool stopping = false;
    std::thread thread;

    void work(const std::function<std::unique_ptr<GlContext>()>& make, std::promise<void>& made) {
        std::unique_ptr<GlContext> context;
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

GlThread::GlThread(std::function<std::unique_ptr<GlContext>()> make) : state_(std::make_unique<State>()) {
    std::promise<void> made;
    auto future = made.get_future();
    state_->thread = std::thread([&state = *state_, &make, &made] { state.work(make, made); });
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
    }
    state_->wake.notify_one();
    state_->thread.join();
}

void GlThread::run(const std::function<void(GlContext&)>& job) {
    std::packaged_task<void(GlContext&)> task(job);
    auto done = task.get_future();
    {
        std::lock_guard lock(state_->mutex);
        state_->jobs.push_back(std::move(task));
    }
    state_->wake.notify_one();
    done.get();
}

std::string GlThread::describe() {
    std::string described;
    run([&](GlContext& context) { described = context.describe(); });
    return described;
}

}  // namespace brume
