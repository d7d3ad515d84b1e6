#include "frame/depth_encoding.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/core/utility.hpp>

#include "error.hpp"

namespace brume {

namespace {

using Kind = DepthEncoding::Kind;

constexpr double inf = DepthEncoding::infinity;
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

// Each turns n stored numbers into metres in the encoding's own sense (planar or along the ray), +inf for
// sky, NaN or ≤ 0 for unknown. Plain loops over doubles, so that they vectorise.

void linear(const DepthEncoding& e, const double* v, double* z, int n) {
    const double zero = e.zeroIsSky ? inf : nan;
    for (int i = 0; i < n; ++i) {
        double metres = v[i] * e.scaleToMetres;
        metres = v[i] == 0 ? zero : metres;
        z[i] = v[i] >= e.skyAtOrAbove ? inf : metres;
    }
}

// MODELS.md §0: the forms that keep 6e-8; 1 - δ must be taken in fp64.
void device(const DepthEncoding& e, const double* delta, double* z, int n) {
    const double toMetres = e.metresPerUnit, near = e.nearPlane, far = e.farPlane;
    const bool endless = std::isinf(far);
    for (int i = 0; i < n; ++i) {
        const double d = delta[i];
        const double towardsFar = e.reversed ? d : 1 - d, towardsNear = e.reversed ? 1 - d : d;
        const double metres =
            (endless ? near / towardsFar : far * near / (towardsFar * far + towardsNear * near)) * toMetres;
        const double inside = towardsNear >= 0 ? metres : nan;
        z[i] = towardsFar <= 0 ? inf : inside;
    }
}

void inverse(const DepthEncoding& e, double numerator, const double* v, double* z, int n) {
    for (int i = 0; i < n; ++i) {
        const double d = v[i] * e.disparityScale + e.disparityOffset;
        z[i] = d <= 0 ? inf : numerator / d;
    }
}

void decodeRow(const DepthEncoding& e, const std::array<double, 2>& range, const double* v, double* scratch,
               double* z, int n) {
    const double zero = range[0], span = range[1] - range[0];
    switch (e.kind) {
        case Kind::Linear:
            return linear(e, v, z, n);
        case Kind::Device:
            for (int i = 0; i < n; ++i) scratch[i] = (v[i] - zero) / span;
            return device(e, scratch, z, n);
        case Kind::Reshade:
            for (int i = 0; i < n; ++i) {
                const double l = (v[i] - zero) / span;
                scratch[i] = l * e.reshadeFar / (1 + l * (e.reshadeFar - 1));
            }
            return device(e, scratch, z, n);
        case Kind::Disparity:
            return inverse(e, e.focalBaseline, v, z, n);
        case Kind::Inverse:
            return inverse(e, 1, v, z, n);
    }
}

template <class T>
void toDouble(const T* v, double* out, int n) {
    for (int i = 0; i < n; ++i) out[i] = v[i];
}

}  // namespace

std::array<double, 2> storedRange(const DepthEncoding& e, int depth) {
    return e.range.value_or(std::array<double, 2>{0, depth == CV_8U ? 255. : depth == CV_16U ? 65535. : 1.});
}

cv::Mat decodeDepth(const cv::Mat& stored, const DepthEncoding& e, const Camera& camera) {
    if (stored.channels() != 1 ||
        (stored.depth() != CV_8U && stored.depth() != CV_16U && stored.depth() != CV_32F))
        failUsage("depth must be one channel of 8 or 16 bits or float32");
    const int n = stored.cols;
    const std::array<double, 2> range = storedRange(e, stored.depth());
    cv::Mat depth(stored.size(), CV_32F);
    cv::parallel_for_(cv::Range(0, stored.rows), [&](const cv::Range& rows) {
        std::vector<double> v(n), scratch(n), z(n);
        for (int j = rows.start; j < rows.end; ++j) {
            switch (stored.depth()) {
                case CV_8U:
                    toDouble(stored.ptr<uchar>(j), v.data(), n);
                    break;
                case CV_16U:
                    toDouble(stored.ptr<ushort>(j), v.data(), n);
                    break;
                default:
                    toDouble(stored.ptr<float>(j), v.data(), n);
            }
            decodeRow(e, range, v.data(), scratch.data(), z.data(), n);
            if (e.alongRay)
                for (int i = 0; i < n; ++i) z[i] /= cv::norm(camera.ray(i, j));
            for (const double unknown : e.unknown)
                for (int i = 0; i < n; ++i) z[i] = v[i] == unknown ? nan : z[i];
            float* out = depth.ptr<float>(j);
            for (int i = 0; i < n; ++i) {
                const float metres = float(z[i] >= e.skyBeyond ? inf : z[i]);
                out[i] = metres > 0 ? metres : float(nan);
            }
        }
    });
    return depth;
}

double encodeDepth(double z, const DepthEncoding& e) {
    const bool sky = std::isinf(z);
    switch (e.kind) {
        case Kind::Linear:
            if (sky) return e.zeroIsSky ? 0 : std::max(e.skyAtOrAbove, 1e10);
            return z / e.scaleToMetres;
        case Kind::Device:
        case Kind::Reshade: {
            const double n = e.nearPlane, f = e.farPlane, units = z / e.metresPerUnit;
            double towardsFar = sky ? 0 : std::isinf(f) ? n / units : n * (f - units) / (units * (f - n));
            const double delta = e.reversed ? towardsFar : 1 - towardsFar;
            const std::array<double, 2> range = storedRange(e, CV_32F);
            const double shown =
                e.kind == Kind::Device ? delta : delta / (e.reshadeFar - delta * (e.reshadeFar - 1));
            return range[0] + shown * (range[1] - range[0]);
        }
        case Kind::Disparity:
            return ((sky ? 0 : e.focalBaseline / z) - e.disparityOffset) / e.disparityScale;
        case Kind::Inverse:
            return ((sky ? 0 : 1 / z) - e.disparityOffset) / e.disparityScale;
    }
    return nan;
}

std::string DepthEncoding::describe() const {
    std::ostringstream out;
    const auto planes = [&] {
        out << ", near " << nearPlane * metresPerUnit << " m, far ";
        if (std::isinf(farPlane))
            out << "infinite";
        else
            out << farPlane * metresPerUnit << " m";
        if (reversed) out << ", reversed";
    };
    switch (kind) {
        case Kind::Linear:
            out << "linear, " << scaleToMetres << " m a unit";
            break;
        case Kind::Device:
            out << "device depth";
            planes();
            break;
        case Kind::Reshade:
            out << "ReShade's normalised depth (far " << reshadeFar << ")";
            planes();
            break;
        case Kind::Disparity:
            out << "disparity, focal length × baseline " << focalBaseline << " px·m";
            break;
        case Kind::Inverse:
            out << "inverse depth, " << disparityScale << " /m a unit";
            break;
    }
    if (alongRay) out << ", along the ray";
    for (size_t i = 0; i < unknown.size(); ++i) out << (i ? ", " : ", unknown ") << unknown[i];
    return out.str();
}

}  // namespace brume
