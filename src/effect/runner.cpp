#include "effect/runner.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <opencv2/core/utility.hpp>

#include "effect/kit/math.hpp"
#include "error.hpp"
#include "strict_json.hpp"

namespace brume {

View viewFor(const FramePair& frame, cv::Size size) {
    const cv::Size stated = frame.statedSize();
    View view = View::of(frame.camera, size.width, size.height, stated.width, stated.height);
    view.time = float(frame.time);
    view.exactTime = frame.time;
    view.frameIndex = frame.index;
    view.seed = frame.seed;
    return view;
}

DeriveContext deriveContextFor(const FramePair& frame, cv::Size size) {
    DeriveContext context;
    context.camera = frame.camera.resized(frame.statedSize(), size);
    context.size = size;
    context.frameSize = frame.statedSize();
    context.time = frame.time;
    context.frameIndex = frame.index;
    context.seed = frame.seed;
    context.extras = frame.extras;
    return context;
}

// --- derived constants ---------------------------------------------------------------------------

static void append(std::string& key, const double* numbers, size_t count) {
    key.append(reinterpret_cast<const char*>(numbers), count * sizeof(double));
}

static void append(std::string& key, const ParameterValue& value) {
    append(key, value.numbers.data(), value.numbers.size());
    for (const auto& row : value.rows) {
        key += '[';
        for (const auto& [name, field] : row) append(key, field);
    }
}

static std::string cacheKey(const Derived& derived, const Step& step, const DeriveContext& c) {
    std::string key;
    for (const auto& from : derived.from) {
        key += from + '=';
        // An effect may name a parameter as a property of the frame is named: then it comes from both.
        if (auto own = step.values.find(from); own != step.values.end()) append(key, own->second);
        if (from == "camera") {
            const double intrinsics[] = {c.camera.fx, c.camera.fy, c.camera.cx, c.camera.cy};
            append(key, intrinsics, 4);
            append(key, c.camera.worldFromCamera.val, 16);
        } else if (from == "size") {
            const double sizes[] = {double(c.size.width), double(c.size.height), double(c.frameSize.width),
                                    double(c.frameSize.height)};
            append(key, sizes, 4);
        } else if (from == "time") {
            append(key, &c.time, 1);
        } else if (from == "frame") {
            const double numbers[] = {double(c.frameIndex), double(c.seed)};
            append(key, numbers, 2);
        } else if (from == "sidecar") {
            key += c.extras ? shownJson(*c.extras) : "";
        }
    }
    return key;
}

static size_t expectedCount(const Derived& derived, const std::map<std::string, double>& variables) {
    switch (derived.type) {
        case Derived::Type::Float:
        case Derived::Type::Int:
            return 1;
        case Derived::Type::Vec2:
            return 2;
        case Derived::Type::Vec3:
            return 3;
        case Derived::Type::Vec4:
            return 4;
        case Derived::Type::Mat4:
            return 16;
        default:
            break;
    }
    size_t count = derived.type == Derived::Type::Vec4Array ? 4 : 1;
    for (const auto& size : derived.size) count *= evaluateSize(size, variables, 1);
    return count;
}

const DerivedValues& DerivedCache::get(const Step& step, const PluginEffect::Params& params,
                                       const DeriveContext& context) {
    const EffectHeader& header = step.effect->header;
    Entry& entry = entries_[step.id + '\n' + header.path];
    for (const auto& derived : header.derived) {
        std::string key = cacheKey(derived, step, context);
        auto& known = entry.keys[derived.name];
        if (known == key && entry.values.count(derived.name)) continue;
        auto numbers = step.effect->plugin->derive(derived.name, params, context);
        // Sizes of later tables may depend on whole numbers derived before them.
        size_t expected = expectedCount(derived, passVariables(step, context.size, entry.values));
        if (numbers.size() != expected)
            throw Error(ErrorKind::CheckFailed,
                        text(step.id, ": derive gave ", numbers.size(), " numbers for '", derived.name,
                             "', its header says ", expected));
        entry.values[derived.name].assign(numbers.begin(), numbers.end());
        known = key;
    }
    return entry.values;
}

// --- sizes ---------------------------------------------------------------------------------------

int evaluateSize(const SizeExpression& expression, const std::map<std::string, double>& variables,
                 int otherwise) {
    if (expression.empty()) return otherwise;
    double size = expression.evaluate(variables);
    if (!std::isfinite(size) || size > 1 << 24)
        failUsage("size expression '", expression.source(), "' gives ", size,
                  "; a size of at most 16777216 is needed");
    return int(std::max(1., std::floor(size)));
}

std::map<std::string, double> passVariables(const Step& step, cv::Size size, const DerivedValues& derived) {
    auto variables = expressionVariables(step.effect->header, step.values);
    variables["WIDTH"] = size.width;
    variables["HEIGHT"] = size.height;
    for (const auto& constant : step.effect->header.derived) {
        auto found = derived.find(constant.name);
        if (constant.type == Derived::Type::Int && found != derived.end())
            variables[constant.name] = found->second[0];
    }
    return variables;
}

cv::Size outputSize(const Step& step, cv::Size input, const DerivedValues& derived) {
    const Pass& last = step.effect->header.passes.back();
    if (!step.effect->header.linear || (last.width.empty() && last.height.empty())) return input;
    auto variables = passVariables(step, input, derived);
    return {evaluateSize(last.width, variables, input.width),
            evaluateSize(last.height, variables, input.height)};
}

cv::Mat fourChannels(const cv::Mat& image) {
    if (image.channels() == 4) return image;
    const cv::Mat opaque(image.size(), CV_32F, cv::Scalar(1));
    cv::Mat grey;
    cv::merge(std::vector<cv::Mat>{image, image, image, opaque}, grey);
    return grey;
}

cv::Mat resampleNearest(const cv::Mat& image, cv::Size size) {
    if (image.size() == size) return image;
    cv::Mat result(size, image.type());
    const size_t bytes = image.elemSize();
    std::vector<size_t> offsets(size.width);  // of a row's pixels
    for (int i = 0; i < size.width; i++)
        offsets[i] = size_t((2LL * i + 1) * image.cols / (2LL * size.width)) * bytes;
    cv::parallel_for_({0, size.height}, [&](const cv::Range& rows) {
        for (int j = rows.start; j < rows.end; j++) {
            const uchar* from = image.ptr(int((2LL * j + 1) * image.rows / (2LL * size.height)));
            uchar* to = result.ptr(j);
            if (bytes == sizeof(float))
                for (int i = 0; i < size.width; i++)
                    std::memcpy(to + i * sizeof(float), from + offsets[i], sizeof(float));
            else
                for (int i = 0; i < size.width; i++) std::memcpy(to + i * bytes, from + offsets[i], bytes);
        }
    });
    return result;
}

LinearRows::Taps::Taps(int from, int to) : first(to), second(to), share(to) {
    for (int i = 0; i < to; i++) {
        const int64_t numerator = (2LL * i + 1) * from - to, denominator = 2LL * to;
        int64_t whole = numerator / denominator;
        if (numerator < whole * denominator) whole--;
        first[i] = int(std::clamp<int64_t>(whole, 0, from - 1));
        second[i] = int(std::clamp<int64_t>(whole + 1, 0, from - 1));
        share[i] = float(numerator - whole * denominator) / float(denominator);
    }
}

LinearRows::LinearRows(const cv::Mat& image, cv::Size size)
    : image_(image), columns_(image.cols, size.width), rows_(image.rows, size.height) {
    CV_Assert(image.type() == CV_32FC4);
    const auto &first = columns_.first, &second = columns_.second;
    for (int i = 1; i <= size.width; i++)
        if (i == size.width || first[i] != first[i - 1] || second[i] != second[i - 1]) runEnds_.push_back(i);
    columns_.share.resize(size.width + 6);  // mixColumns reads eight at a time
}

// Two pixels, one; unaligned.
typedef float Pixels __attribute__((vector_size(32), aligned(4), may_alias));
typedef float Pixel __attribute__((vector_size(16), aligned(4), may_alias));

// Each pixel of `out` is pixels `first` and `second` of `line`, mixed; up to each of `ends` they are the same
// two. Reads four floats beyond the line, six beyond the shares.
BRUME_VECTORISE static void mixColumns(float* out, const float* line, const int* first, const int* second,
                                       const float* share, const int* ends, size_t endCount) {
    int i = 0;
    for (size_t r = 0; r < endCount; r++) {
        const float *a = line + 4 * first[i], *b = line + 4 * second[i];
        Pixels twoA = *reinterpret_cast<const Pixels*>(a), twoB = *reinterpret_cast<const Pixels*>(b);
        twoA = __builtin_shufflevector(twoA, twoA, 0, 1, 2, 3, 0, 1, 2, 3);
        twoB = __builtin_shufflevector(twoB, twoB, 0, 1, 2, 3, 0, 1, 2, 3);
        for (; i + 2 <= ends[r]; i += 2) {
            const Pixels s = *reinterpret_cast<const Pixels*>(share + i),
                         w = __builtin_shufflevector(s, s, 0, 0, 0, 0, 1, 1, 1, 1);
            *reinterpret_cast<Pixels*>(out + 4 * i) = twoA * (1 - w) + twoB * w;
        }
        for (; i < ends[r]; i++)
            *reinterpret_cast<Pixel*>(out + 4 * i) = *reinterpret_cast<const Pixel*>(a) * (1 - share[i]) +
                                                     *reinterpret_cast<const Pixel*>(b) * share[i];
    }
}
BRUME_VECTORISE static void mixRows(float* out, const float* above, const float* below, float share,
                                    int floats) {
    for (int k = 0; k < floats; k++) out[k] = above[k] * (1 - share) + below[k] * share;
}

void LinearRows::write(int j, float* to, Memory& memory) const {
    const int width = int(columns_.first.size()), wanted[2] = {rows_.first[j], rows_.second[j]};
    if (memory.row[1] == wanted[0] || memory.row[0] == wanted[1]) {
        std::swap(memory.row[0], memory.row[1]);
        std::swap(memory.wide[0], memory.wide[1]);
    }
    for (int k = 0; k < 2; k++) {
        if (memory.row[k] == wanted[k]) continue;
        memory.wide[k].resize(4 * size_t(width));
        memory.line.resize(4 * size_t(image_.cols) + 4);
        std::copy_n(image_.ptr<float>(wanted[k]), 4 * image_.cols, memory.line.begin());
        mixColumns(memory.wide[k].data(), memory.line.data(), columns_.first.data(), columns_.second.data(),
                   columns_.share.data(), runEnds_.data(), runEnds_.size());
        memory.row[k] = wanted[k];
    }
    mixRows(to, memory.wide[0].data(), memory.wide[1].data(), rows_.share[j], 4 * width);
}

cv::Mat resampleLinear(const cv::Mat& image, cv::Size size) {
    if (image.size() == size) return image;
    const LinearRows rows(image, size);
    cv::Mat result(size, CV_32FC4);
    cv::parallel_for_(cv::Range(0, size.height), [&](const cv::Range& range) {
        LinearRows::Memory memory;
        for (int j = range.start; j < range.end; j++) rows.write(j, result.ptr<float>(j), memory);
    });
    return result;
}

}  // namespace brume
