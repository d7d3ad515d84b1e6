#include "measure/plot_words.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <opencv2/core/types.hpp>

namespace brume {
namespace {

// px: the smallest panel's inside, and letters of fonts 8 and 9.
constexpr double panelWidth = 360, panelHeight = 240;

double lettersOf(const std::string& word) {
    return double(std::count_if(word.begin(), word.end(), [](char c) { return (c & 0xc0) != 0x80; }));
}
double widthOf(const std::string& word, int fontSize) { return .62 * fontSize * lettersOf(word) + 2; }

// What words should not lie on.
class Ground {
  public:
    explicit Ground(const PlotPanel& panel) : x_(plotAxis(panel, true)), y_(plotAxis(panel, false)) {
        for (const PlotSeries& s : panel.series)
            for (size_t k = 0; k < s.points.size(); k++) {
                const cv::Point2d p = placeOf(s.points[k]);
                if (!isPlace(p)) continue;
                for (int n = 0; n < 3; n++) things_.push_back(p);  // a disc hides more than a line
                if (s.points[k].xHigh > s.points[k].xLow)
                    join({x_.share(s.points[k].xLow), p.y}, {x_.share(s.points[k].xHigh), p.y});
                if (k == 0 || s.kind == PlotSeries::Kind::Points || !isPlace(placeOf(s.points[k - 1])))
                    continue;
                const cv::Point2d q = placeOf(s.points[k - 1]);
                if (s.kind == PlotSeries::Kind::Frontier)  // a staircase: along, then down
                    join(q, {p.x, q.y}), join({p.x, q.y}, p);
                else
                    join(q, p);
            }
        for (const PlotMark& m : panel.marks)
            (m.isVertical ? upright_ : level_).push_back((m.isVertical ? x_ : y_).share(m.at));
    }

    const PlotAxis& x() const { return x_; }
    const PlotAxis& y() const { return y_; }

    double cost(const PlotWord& w) const {
        constexpr double onWord = 100, onLine = 4;
        double sum = 0;
        if (w.left < 0 || w.right > 1.03 || w.bottom < 0 || w.top > 1.03) sum += onWord;
        for (const PlotWord& other : words_)
            if (w.left < other.right && w.right > other.left && w.bottom < other.top && w.top > other.bottom)
                sum += onWord;
        constexpr double padX = 3 / panelWidth, padY = 3 / panelHeight;  // half a mark
        for (const cv::Point2d& p : things_)
            sum += p.x > w.left - padX && p.x < w.right + padX && p.y > w.bottom - padY && p.y < w.top + padY;
        for (double at : upright_) sum += at > w.left && at < w.right ? onLine : 0;
        for (double at : level_) sum += at > w.bottom && at < w.top ? onLine : 0;
        return sum;
    }

    // The best of `candidates`, the first of equals; whether it keeps clear of other words.
    bool place(const std::vector<PlotWord>& candidates, bool mayBeLeftOut) {
        const PlotWord* best = nullptr;
        double least = HUGE_VAL;
        for (const PlotWord& w : candidates)
            if (const double c = cost(w); c < least) best = &w, least = c;
        if (!best || (mayBeLeftOut && least >= 100)) return false;
        words_.push_back(*best);
        return true;
    }

    std::vector<PlotWord> words() const { return words_; }

  private:
    cv::Point2d placeOf(const PlotPoint& p) const {
        return {x_.share(p.x), y_.share(std::clamp(p.y, y_.least, y_.most))};
    }
    static bool isPlace(const cv::Point2d& p) { return std::isfinite(p.x) && std::isfinite(p.y); }
    void join(const cv::Point2d& a, const cv::Point2d& b) {
        constexpr int parts = 40;
        for (int n = 0; n <= parts; n++) things_.push_back(a + (b - a) * (n / double(parts)));
    }

    PlotAxis x_, y_;
    std::vector<cv::Point2d> things_;
    std::vector<double> upright_, level_;
    std::vector<PlotWord> words_;
};

// A word of which one end's middle is dx, dy px from (x, y).
PlotWord wordAt(const std::string& word, double x, double y, double dx, double dy, int fontSize,
                bool endsHere = false, bool isUpright = false) {
    PlotWord w{word, x + dx / panelWidth, y + dy / panelHeight, endsHere, isUpright, fontSize, ""};
    const double length = widthOf(word, fontSize), half = .62 * fontSize;
    const double wide = (isUpright ? 2 * half : length) / panelWidth,
                 high = (isUpright ? length : 2 * half) / panelHeight;
    w.left = isUpright ? w.x - wide / 2 : endsHere ? w.x - wide : w.x;
    w.right = w.left + wide;
    w.bottom = isUpright ? (endsHere ? w.y - high : w.y) : w.y - high / 2;
    w.top = w.bottom + high;
    return w;
}

std::vector<PlotWord> candidatesFor(const PlotMark& mark, double at) {
    std::vector<PlotWord> all;
    if (!mark.isVertical) {
        for (double dy : {7., -8.}) {
            all.push_back(wordAt(mark.label, .985, at, 0, dy, 9, true));
            for (double x : {.1, .02, .3}) all.push_back(wordAt(mark.label, x, at, 0, dy, 9));
        }
    } else if (mark.series.empty()) {
        for (double dx : {8., -8.})
            for (double y : {.02, .98}) all.push_back(wordAt(mark.label, at, y, dx, 0, 9, y > .5, true));
    } else {  // short: beside the top of its line, one below the other where lines are near
        for (double y : {.965, .91, .855, .8})
            for (bool endsHere : {false, true})
                all.push_back(wordAt(mark.label, at, y, endsHere ? -4 : 4, 0, 8, endsHere));
    }
    for (PlotWord& w : all) w.series = mark.series;
    return all;
}

std::string tickWord(double value) {
    char buffer[40];
    std::snprintf(buffer, sizeof buffer, "%.10g", value);
    if (value >= 1e-4 * (1 - 1e-9) && value < 99999) return buffer;
    std::snprintf(buffer, sizeof buffer, "%.0e", value);
    std::string word = buffer;
    if (const size_t e = word.find_first_of("+-"); e != std::string::npos) {
        if (word[e + 1] == '0') word.erase(e + 1, 1);
        if (word[e] == '+') word.erase(e, 1);
    }
    return word;
}

}  // namespace

double PlotAxis::share(double value) const {
    return isLog ? std::log(value / least) / std::log(most / least) : (value - least) / (most - least);
}

PlotAxis plotAxis(const PlotPanel& panel, bool ofX) {
    const bool isLog = ofX ? panel.logX : panel.logY;
    const auto given = ofX ? panel.xRange : panel.yRange;
    if (given.first != given.second) return {given.first, given.second, isLog};
    double least = HUGE_VAL, most = -HUGE_VAL;
    auto take = [&](double v) {
        if (!std::isfinite(v) || (isLog && v <= 0)) return;
        least = std::min(least, v);
        most = std::max(most, v);
    };
    for (const PlotSeries& s : panel.series)
        for (const PlotPoint& p : s.points) take(ofX ? p.x : p.y);
    for (const PlotMark& m : panel.marks)
        if (m.isVertical == ofX) take(m.at);
    if (!(least <= most)) return {isLog ? .1 : 0, 1, isLog};
    if (!isLog) return {least - .05 * (most - least), most + .05 * (most - least) + (most == least), isLog};
    return {least / 1.6, most * 1.6, isLog};
}

std::vector<PlotWord> placeWords(const PlotPanel& panel) {
    Ground ground(panel);
    for (const PlotMark& m : panel.marks) {
        const PlotAxis& axis = m.isVertical ? ground.x() : ground.y();
        if (axis.holds(m.at) && !m.label.empty()) ground.place(candidatesFor(m, axis.share(m.at)), false);
    }
    for (const PlotSeries& s : panel.series)
        for (const PlotPoint& p : s.points) {
            const double x = ground.x().share(p.x), y = ground.y().share(p.y);
            if (p.label.empty() || !std::isfinite(x) || !std::isfinite(y)) continue;
            std::vector<PlotWord> corners;
            for (double dx : {4., -4.})
                for (double dy : {8., -8.}) {
                    corners.push_back(wordAt(p.label, x, y, dx, dy, 8, dx < 0));
                    corners.back().series = s.name;
                }
            ground.place(corners, true);
        }
    return ground.words();
}

PlotTicks logTicks(const PlotAxis& axis) {
    const int first = int(std::floor(std::log10(axis.least) + 1e-9)),
              last = int(std::ceil(std::log10(axis.most) - 1e-9));
    int decades = 0;
    for (int n = first; n <= last; n++) decades += axis.holds(std::pow(10, n));
    const double span = std::log10(axis.most / axis.least);
    const int stride = (decades + 6) / 7;
    PlotTicks ticks;
    for (int n = first; n <= last; n++)
        for (int digit = 1; digit < 10; digit++) {
            const double at = digit * std::pow(10, n);
            if (!axis.holds(at)) continue;
            const bool isNamed = digit == 1                 ? n % stride == 0
                                 : digit == 2 || digit == 5 ? span < 1.7
                                                            : span < .6;
            if (isNamed || digit == 1 || span < 8) ticks.emplace_back(at, isNamed ? tickWord(at) : "");
        }
    return ticks;
}

PlotTicks thinned(const PlotTicks& ticks, const PlotAxis& axis) {
    auto touches = [&](size_t stride) {
        for (size_t k = 0; k + stride < ticks.size(); k += stride) {
            const double apart =
                panelWidth * (axis.share(ticks[k + stride].first) - axis.share(ticks[k].first));
            if (apart < (widthOf(ticks[k].second, 9) + widthOf(ticks[k + stride].second, 9)) / 2 + 4)
                return true;
        }
        return false;
    };
    size_t stride = 1;
    while (stride < ticks.size() && touches(stride)) stride++;
    PlotTicks kept = ticks;
    for (size_t k = 0; k < kept.size(); k++)
        if (k % stride) kept[k].second.clear();
    return kept;
}

}  // namespace brume
