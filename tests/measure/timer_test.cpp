#include "measure/timer.hpp"

#include <gtest/gtest.h>

#include <set>

using namespace brume;

namespace {

TEST(Timer, quantilesOfKnownValues) {
    Timing timing{"x", {5, 1, 4, 2, 3}};
    EXPECT_EQ(timing.median(), 3);
    EXPECT_EQ(timing.quartileLow(), 2);
    EXPECT_EQ(timing.quartileHigh(), 4);
    EXPECT_EQ((Timing{"x", {1, 2}}.median()), 1.5);
}

TEST(Timer, candidatesTakeTurnsAfterOneWarmUpEach) {
    std::vector<int> order;
    auto timings = takeTurns(
        {{"a", [&](int) { order.push_back(0); }}, {"b", [&](int) { order.push_back(1); }}}, 8, 5, 100);
    EXPECT_EQ(order.size(), 2u * 6);
    for (size_t k = 0; k < order.size(); k++) EXPECT_EQ(order[k], int(k % 2));
    ASSERT_EQ(timings.size(), 2u);
    EXPECT_EQ(timings[0].name, "a");
    EXPECT_EQ(timings[1].milliseconds.size(), 5u);
}

TEST(Timer, everyCandidateMeetsEverySlotAndNobodyFindsAWarmOne) {
    for (int count : {1, 2, 3, 4}) {
        std::vector<std::set<int>> seen(count);
        int last = -1;
        std::vector<Candidate> candidates;
        for (int k = 0; k < count; k++)
            candidates.push_back({"", [&, k](int slot) {
                                      EXPECT_NE(slot, last);
                                      seen[k].insert(last = slot);
                                  }});
        takeTurns(candidates, 8, 64, 100);
        for (int k = 0; k < count; k++) EXPECT_EQ(seen[k].size(), 8u) << count << " candidates, " << k;
    }
}

TEST(Timer, threeRepetitionsHoweverShortTheTime) {
    auto timings = takeTurns({{"a", [](int) {}}}, 8, 24, 0);
    EXPECT_EQ(timings[0].milliseconds.size(), 3u);
}

}  // namespace
