// For the thread sanitizer: cv::parallel_for_ on threads that it can see into. OpenCV's own, TBB, hands work
// over by atomics in code that is not instrumented, so that all work would look like a race.
#include <algorithm>
#include <atomic>
#include <opencv2/core/parallel/parallel_backend.hpp>
#include <thread>
#include <vector>

namespace {

class Threads final : public cv::parallel::ParallelForAPI {
  public:
    void parallel_for(int tasks, FN_parallel_for_body_cb_t body, void* data) override {
        std::atomic<int> next = 0;
        const auto work = [&](int number) {
            numberOfThread = number;
            for (int task = next++; task < tasks; task = next++) body(task, task + 1, data);
        };
        const int before = numberOfThread;
        std::vector<std::thread> others;
        for (int k = 1; k < std::min(getNumThreads(), tasks); ++k) others.emplace_back(work, k);
        work(before);
        for (std::thread& other : others) other.join();
    }
    int getThreadNum() const override { return numberOfThread; }
    int getNumThreads() const override { return count_; }
    int setNumThreads(int count) override { return count_.exchange(count < 1 ? 4 : count); }
    const char* getName() const override { return "threads"; }

  private:
    static thread_local int numberOfThread;
    std::atomic<int> count_ = 4;
};

thread_local int Threads::numberOfThread = 0;

[[maybe_unused]] const bool isSet = [] {
    cv::parallel::setParallelForBackend(std::make_shared<Threads>());
    return true;
}();

}  // namespace
