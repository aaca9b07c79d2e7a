"""Language models: llm is the seam; translation_prompt and model_translate ask for CGQL, rerank for judgement."""
