// cv::GaussianBlur as a peer of gaussian_blur (the protocol: src/measure/peer.hpp).
#include <chrono>
#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/core/utility.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

int main(int, char** arguments) {
    const std::string folder = arguments[1];
    std::ifstream file(folder + "/job.json");
    const auto job = nlohmann::json::parse(file);
    const cv::Size size(job.at("width"), job.at("height"));
    const double sigma = job.at("parameters").at("radius");
    cv::Mat image(size, CV_32FC4), blurred(size, CV_32FC4);
    const auto bytes = std::streamsize(image.total() * image.elemSize());
    std::ifstream(folder + "/color.f32", std::ios::binary).read(image.ptr<char>(), bytes);

    std::vector<double> milliseconds;
    for (int k = 0; k <= job.at("repetitions").get<int>(); k++) {
        const auto start = std::chrono::steady_clock::now();
        cv::GaussianBlur(image, blurred, {}, sigma, sigma, cv::BORDER_REPLICATE);
        const std::chrono::duration<double, std::milli> taken = std::chrono::steady_clock::now() - start;
        if (k > 0) milliseconds.push_back(taken.count());  // the first touches the memory
    }
    std::ofstream(folder + "/output.f32", std::ios::binary).write(blurred.ptr<char>(), bytes);
    const std::string device = "OpenCV " CV_VERSION ", " + std::to_string(cv::getNumThreads()) + " threads";
    std::ofstream(folder + "/result.json")
        << nlohmann::json{{"device", device}, {"milliseconds", milliseconds}};
}
