// What the tests of runs over many frames share.
#pragma once

#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>

#include "host/program.hpp"

namespace brume::test {

/// `apply` on frames in/f.0001.exr and so on.
class ManyFrames : public Program {
  protected:
    void addFrames(int count, cv::Size size = {40, 24}) {
        for (int k = 1; k <= count; k++) {
            char name[32];
            std::snprintf(name, sizeof name, "in/f.%04d.exr", k);
            addFrame(name, size, k);
        }
    }
    // Name and bytes of all pictures of a folder.
    std::map<std::string, std::string> pictures(const std::string& folder) const {
        std::map<std::string, std::string> all;
        for (const auto& entry : std::filesystem::directory_iterator(path(folder)))
            if (!entry.path().filename().string().starts_with("contact_sheet"))
                all[entry.path().filename().string()] = bytesOf(entry.path().string());
        return all;
    }
    nlohmann::json reportAt(const std::string& name) const {
        return nlohmann::json::parse(bytesOf(path(name)));
    }
};

}  // namespace brume::test
