#include "measure/peer.hpp"

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "error.hpp"
#include "strict_json.hpp"

namespace brume {
namespace {

namespace fs = std::filesystem;
using json = nlohmann::json;

// Removed with all that is in it.
class Folder {
  public:
    Folder() : path_((fs::temp_directory_path() / "brume-peer-XXXXXX").string()) {
        if (!mkdtemp(path_.data())) failIo(path_, ": cannot be made; set TMPDIR to a folder that can");
    }
    ~Folder() {
        std::error_code none;
        fs::remove_all(path_, none);
    }
    std::string file(const char* name) const { return path_ + "/" + name; }
    const std::string& path() const { return path_; }

  private:
    std::string path_;
};

void writeRaw(const cv::Mat& image, const std::string& path) {
    std::ofstream out(path, std::ios::binary);
    for (int j = 0; j < image.rows; j++)
        out.write(image.ptr<char>(j), std::streamsize(size_t(image.cols) * image.elemSize()));
    if (!out.flush()) failIo("'", path, "' cannot be written");
}

std::string lastLine(const std::string& path) {
    std::ifstream in(path);
    std::string last;
    for (std::string line; std::getline(in, line);)
        if (!line.empty()) last = line;
    return last;
}

int run(const std::string& program, const std::string& folder, const std::string& words) {
    const pid_t child = fork();
    if (child < 0) return 127;
    if (child == 0) {
        const int log = open(words.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
        if (log >= 0) dup2(log, STDERR_FILENO), dup2(log, STDOUT_FILENO);
        execl(program.c_str(), program.c_str(), folder.c_str(), nullptr);
        _exit(127);
    }
    int status = 0;
    while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
    }
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128;
}

}  // namespace

PeerResult runPeer(const std::string& program, const EffectHeader& header, const ParameterValues& values,
                   const FramePair& frame, int repetitions) {
    const Folder folder;
    json parameters = json::object();
    for (const Parameter& p : header.parameters) parameters[p.name] = toJson(p, values.at(p.name));
    const Camera& c = frame.camera;
    const json job = {{"width", frame.size().width},
                      {"height", frame.size().height},
                      {"camera", {{"fx", c.fx}, {"fy", c.fy}, {"cx", c.cx}, {"cy", c.cy}}},
                      {"parameters", parameters},
                      {"repetitions", repetitions}};
    std::ofstream(folder.file("job.json")) << job.dump(1);
    writeRaw(frame.color, folder.file("color.f32"));
    writeRaw(frame.depth, folder.file("depth.f32"));

    const int status = run(program, folder.path(), folder.file("words"));
    const std::string words = lastLine(folder.file("words"));
    if (status == 127) failIo("'", program, "' cannot be started");
    if (status == 69) failIo(words.empty() ? "what it needs is not installed" : words);
    if (status != 0) failIo("'", program, "' failed with status ", status, ": ", words);

    PeerResult result;
    try {
        std::ifstream in(folder.file("result.json"));
        const json report = json::parse(in);
        result.device = report.at("device");
        result.timing.milliseconds = report.at("milliseconds").get<std::vector<double>>();
    } catch (const json::exception& e) {
        failIo("'", program, "' left no readable result.json: ", reasonOf(e));
    }
    if (result.timing.milliseconds.empty()) failIo("'", program, "' measured no time");
    result.output.create(frame.size(), CV_32FC4);
    std::ifstream in(folder.file("output.f32"), std::ios::binary);
    const auto bytes = std::streamsize(result.output.total() * result.output.elemSize());
    if (!in.read(result.output.ptr<char>(), bytes) || in.peek() != EOF)
        failIo("'", program, "' left an output.f32 that is not ", bytes, " bytes long");
    return result;
}

}  // namespace brume
