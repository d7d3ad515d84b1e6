// brume_reader's end of the line: decodes one file after another within its limits.
#include <malloc.h>
#include <sys/resource.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <opencv2/core.hpp>
#include <opencv2/core/utility.hpp>

#include "error.hpp"
#include "frame/reader_line.hpp"
#include "frame/reader_process.hpp"
#include "frame/shared_image.hpp"
#include "memory.hpp"

namespace brume {

using nlohmann::json;

namespace {

void limit(decltype(RLIMIT_CPU) what, rlim_t most) {
    struct rlimit both {};
    getrlimit(what, &both);
    both.rlim_cur = std::min(most, both.rlim_max);
    setrlimit(what, &both);
}

rlim_t memoryInUse() {
    size_t total = 0, resident = 0, shared = 0, code = 0, library = 0, data = 0;  // in pages
    std::ifstream("/proc/self/statm") >> total >> resident >> shared >> code >> library >> data;
    return rlim_t(data) * rlim_t(sysconf(_SC_PAGESIZE));
}

/// For the next file. The kernel ends a process that takes more time, and refuses it more memory.
void setLimits(const DecodeRequest& request) {
    struct rusage used {};
    getrusage(RUSAGE_SELF, &used);
    limit(RLIMIT_CPU, rlim_t(used.ru_utime.tv_sec + used.ru_stime.tv_sec) + rlim_t(*request.seconds) + 1);
    if (isSanitized) return;
    const rlim_t machine = machineMemory();
    const rlim_t stacks = rlim_t(cv::getNumThreads()) * (16 << 20);  // OpenCV's threads and OpenEXR's
    const rlim_t usual =
        (rlim_t(1) << 30) + stacks + rlim_t(std::min(request.maxPixels, size_t(1) << 40)) * 32;
    limit(RLIMIT_DATA, memoryInUse() + std::min(machine, *request.memory ? *request.memory : usual));
}

/// In memory that can be handed over.
void makeShared(cv::Mat& image) {
    if (SharedImages::ofThisProcess().isShared(image)) return;
    // Small images are not shared of themselves: they go to the top of one that is.
    const int rows = std::max(image.rows, int((64 << 10) / (image.cols * image.elemSize()) + 1));
    cv::Mat shared(rows, image.cols, image.type());
    image.copyTo(shared.rowRange(0, image.rows));
    image = shared.rowRange(0, image.rows);
}

Message packed(Decoded& decoded) {
    json reply = {{"facts", decoded.facts}, {"images", json::array()}};
    Message answer;
    for (cv::Mat& image : decoded.images) {
        makeShared(image);
        const auto [buffer, file] = SharedImages::ofThisProcess().handOver(image);
        reply["images"].push_back({image.cols, image.rows, image.type(), buffer, file >= 0});
        if (file >= 0) answer.files.push_back(file);
    }
    decoded.images.clear();
    reply["given up"] = SharedImages::ofThisProcess().tidy();
    answer.bytes = json::to_cbor(reply);
    return answer;
}

}  // namespace

void serveDecoding(int line) {
    cv::Mat::setDefaultAllocator(&SharedImages::ofThisProcess());
    decodeInThisProcess();
    // Rows are unpacked in memory of the last frame's, not in fresh pages each time.
    mallopt(M_MMAP_THRESHOLD, 64 << 20);
    mallopt(M_TRIM_THRESHOLD, 256 << 20);
    limit(RLIMIT_CORE, 0);
    limit(RLIMIT_FSIZE, RLIM_INFINITY);  // memory that is shared counts as files
    for (Message question; receiveMessage(line, question); question = {}) {
        Message answer;
        DecodeRequest request;
        const auto refuse = [&](std::string sentence, ErrorKind kind) {
            if (sentence.find(std::strerror(EMFILE)) != std::string::npos)  // and so not the image's fault
                sentence = request.path +
                           ": cannot be read: too many open files; let more be, as by 'ulimit -n 256'";
            answer.bytes = json::to_cbor(json{{"error", sentence}, {"kind", int(kind)}});
        };
        try {
            const json asked = json::from_cbor(question.bytes);
            request = {Decode(asked.at("what").get<int>()),
                       asked.at("path"),
                       asked.at("maxPixels"),
                       asked.at("wantDepth"),
                       asked.at("seconds"),
                       asked.at("memory")};
            for (const int buffer : asked.at("released")) SharedImages::ofThisProcess().takeBack(buffer);
            setLimits(request);
            Decoded decoded = decodeHere(request);
            answer = packed(decoded);
        } catch (const Error& e) {
            refuse(e.what(), e.kind());
        } catch (const std::bad_alloc&) {
            refuse(request.path + ": needs more memory than the limit for its number of pixels",
                   ErrorKind::Io);
        } catch (const std::exception& e) {
            refuse(request.path + ": is damaged: " + e.what(), ErrorKind::Io);
        }
        if (!sendMessage(line, answer)) return;
    }
}

}  // namespace brume
