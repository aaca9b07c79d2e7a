"""English questions to CGQL without a model: phrases, clauses and questions understand, question_tree writes."""
