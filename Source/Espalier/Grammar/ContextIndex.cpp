#include <Espalier/Grammar/ContextIndex.h>

#include <Espalier/Grammar/Word.h>

namespace espalier {

namespace {

constexpr std::uint64_t kStepWork = 4; ///< Of looking at one neighbour, as Limits::derivationWork counts.

} // namespace

void ContextIndex::build(const GrammarProgram& program, const Word& word)
{
    program_ = &program;
    word_ = &word;
    const auto& roles = program.code().roles;
    const auto size = static_cast<std::uint32_t>(word.letters.size());
    arguments_.resize(size);
    left_.resize(size);
    right_.resize(size);
    partner_.resize(size);

    // Towards the base: what was seen last on this axis, or on the one it leaves.
    stack_.clear();
    neighbours_.clear();
    std::uint32_t argument = 0;
    std::uint32_t seen = kNone;
    for (std::uint32_t i = 0; i < size; ++i)
    {
        const LetterId letter = word.letters[i];
        arguments_[i] = argument;
        argument += program.arityOf(letter);
        left_[i] = seen;
        switch (roles[letter])
        {
        case LetterRole::Plain:
            seen = i;
            break;
        case LetterRole::Open:
            stack_.push_back(i);
            neighbours_.push_back(seen);
            break;
        case LetterRole::Close:
            partner_[i] = stack_.back();
            partner_[stack_.back()] = i;
            seen = neighbours_.back();
            stack_.pop_back();
            neighbours_.pop_back();
            break;
        case LetterRole::Ignored:
            break;
        }
    }
    // Towards the tip: from the end, branches stepped over. A [ sees the first module of its branch.
    seen = kNone;
    for (std::uint32_t i = size; i-- > 0;)
    {
        right_[i] = seen;
        switch (roles[word.letters[i]])
        {
        case LetterRole::Plain:
            seen = i;
            break;
        case LetterRole::Close:
            neighbours_.push_back(seen);
            seen = kNone;
            break;
        case LetterRole::Open:
            seen = neighbours_.back();
            neighbours_.pop_back();
            break;
        case LetterRole::Ignored:
            break;
        }
    }
}

void ContextIndex::appendArguments(std::uint32_t position, std::vector<double>& parameters) const
{
    const double* first = word_->arguments.data() + arguments_[position];
    parameters.insert(parameters.end(), first, first + program_->arityOf(word_->letters[position]));
}

bool ContextIndex::matches(const GrammarProgram::Rule& rule, std::uint32_t position, std::vector<double>& parameters,
                           std::uint64_t& work, std::uint64_t mostWork)
{
    work += rule.leftCount;
    if (!matchesLeft(rule, position))
        return false;
    parameters.clear();
    appendArguments(position, parameters);
    if (rule.contextParameters > 0)
        for (std::size_t i = neighbours_.size(); i-- > 0;)
            appendArguments(neighbours_[i], parameters);
    return matchesRight(rule, position, parameters, work, mostWork);
}

/// Leaves the matching modules in neighbours_, the nearest first.
bool ContextIndex::matchesLeft(const GrammarProgram::Rule& rule, std::uint32_t position)
{
    neighbours_.clear();
    std::uint32_t at = position;
    for (std::uint32_t i = 0; i < rule.leftCount; ++i)
    {
        at = left_[at];
        if (at == kNone || word_->letters[at] != program_->code().leftContexts[rule.firstLeft + i])
            return false;
        neighbours_.push_back(at);
    }
    return true;
}

/// The [ of the first branch at or after `place` that hangs on the module before it; kNone if there is none.
std::uint32_t ContextIndex::branchFrom(std::uint32_t place, std::uint64_t& work) const
{
    for (; place < word_->letters.size(); ++place, work += kStepWork)
    {
        const LetterRole role = program_->code().roles[word_->letters[place]];
        if (role == LetterRole::Open)
            return place;
        if (role != LetterRole::Ignored)
            break;
    }
    return kNone;
}

bool ContextIndex::matchesRight(const GrammarProgram::Rule& rule, std::uint32_t position,
                                std::vector<double>& parameters, std::uint64_t& work, std::uint64_t mostWork)
{
    const auto pattern = std::span(program_->code().rightContexts).subspan(rule.firstRight, rule.rightCount);
    branches_.clear();
    alternatives_.clear();
    std::uint32_t at = position;
    std::uint32_t branch = kNone;
    std::uint32_t step = 0;
    while (step < pattern.size())
    {
        if ((work += kStepWork) > mostWork)
            return false;
        bool fits = true;
        switch (pattern[step].role)
        {
        case LetterRole::Plain:
        case LetterRole::Ignored: // no pattern holds one
            at = right_[at];
            fits = at != kNone && word_->letters[at] == pattern[step].letter;
            if (fits && rule.contextParameters > 0)
                appendArguments(at, parameters);
            break;
        case LetterRole::Open:
            if (alternatives_.empty())
                exhausted_.assign(pattern.size(), {});
            if (at + 1 < exhausted_[step].first || at + 1 > exhausted_[step].last)
                alternatives_.push_back({step, at + 1, at + 1, branch, branches_.size(), parameters.size()});
            fits = false; // the first branch is the first alternative
            break;
        case LetterRole::Close:
            at = partner_[branches_[branch].open];
            branch = branches_[branch].outer;
            break;
        }
        ++step;
        if (fits)
            continue;
        // Enter the next branch at the latest place where there is one.
        for (;;)
        {
            if (alternatives_.empty() || work > mostWork)
                return false;
            Alternative& latest = alternatives_.back();
            const std::uint32_t open = branchFrom(latest.place, work);
            if (open == kNone)
            {
                exhausted_[latest.step] = {latest.first, latest.place};
                alternatives_.pop_back();
                continue;
            }
            latest.place = partner_[open] + 1;
            step = latest.step + 1;
            branches_.resize(latest.branches);
            parameters.resize(latest.parameters);
            branches_.push_back({open, latest.branch});
            branch = static_cast<std::uint32_t>(branches_.size() - 1);
            at = open;
            break;
        }
    }
    return true;
}

} // namespace espalier
