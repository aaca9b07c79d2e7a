"""Language models: llm is the seam; translation_prompt and model_translate ask for CGQL, rerank and enrich for judgement."""
