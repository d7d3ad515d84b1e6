#include "measure/check_mirror.hpp"

namespace brume {
namespace {

const char* source = R"(/*{
    "DESCRIPTION": "Mirrors left to right and turns the channels; exact on every backend.",
    "ISFVSN": "2",
    "SPACE": "linear",
    "INPUTS": [{"NAME": "inputImage", "TYPE": "image"}]
}*/
void main() {
    ivec2 p = ivec2(gl_FragCoord.xy);
    brume_color = texelFetch(inputImage, ivec2(passSize.x - 1 - p.x, p.y), 0).gbra;
}
)";

struct None {};

void mirrorRows(const cv::Mat& from, cv::Mat to, cv::Range rows) {
    for (int j = rows.start; j < rows.end; j++)
        for (int i = 0; i < from.cols; i++) {
            const cv::Vec4f& c = from.at<cv::Vec4f>(j, from.cols - 1 - i);
            to.at<cv::Vec4f>(j, i) = {c[1], c[2], c[0], c[3]};
        }
}

void run(const None&, const CpuContext& context) {
    mirrorRows(context.input, context.output, {0, context.output.rows});
}

}  // namespace

std::shared_ptr<const Effect> mirrorEffect() {
    auto effect = std::make_shared<Effect>();
    effect->header = parseHeader("check_mirror.fs", source);
    effect->plugin = std::make_shared<EffectOf<None>>(EffectOf<None>().run(run));
    return effect;
}

cv::Mat mirrored(const cv::Mat& image) {
    cv::Mat result(image.size(), CV_32FC4);
    mirrorRows(image, result, {0, image.rows});
    return result;
}

}  // namespace brume
