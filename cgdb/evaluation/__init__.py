"""How well questions are answered: retrieval runs the ways side by side on judged queries; answers_kept keeps them."""
