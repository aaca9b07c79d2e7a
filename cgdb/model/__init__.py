"""Language models: llm is the seam; prompts and model_translate ask for CGQL, rerank and enrich for judgement."""
