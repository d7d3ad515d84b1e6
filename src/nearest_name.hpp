// "Did you mean ...": the nearest valid name for an error's sentence.
#pragma once

#include <string>
#include <vector>

namespace brume {

/// The candidate with the smallest edit distance, or empty if none is near (more than a third of the
/// letters differ; two that changed places count as one).
std::string nearestName(const std::string& wrong, const std::vector<std::string>& candidates);

/// " (did you mean 'x'?)", or " (there are: a, b, c)", or nothing if there are no candidates.
std::string suggestion(const std::string& wrong, const std::vector<std::string>& candidates);

/// The name in a missing file's folder that is nearest to its own, or empty; of a large folder, among the
/// first 4096 that it gives.
std::string nearestBeside(const std::string& missing);

/// " (did you mean 'folder/x'?)" of that name, or nothing.
std::string suggestionBeside(const std::string& missing);

}  // namespace brume
