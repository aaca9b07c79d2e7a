"""How well questions are answered: retrieval runs the ways on judged queries; scores measures them."""
